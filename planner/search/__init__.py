"""Road orders: planners from problem to plan."""
