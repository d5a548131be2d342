"""UAV flight against futures: who is seen when."""
