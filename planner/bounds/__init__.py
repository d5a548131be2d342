"""How far a plan is from the best one: bounds that no plan of its class can pass."""
