"""A SUMO net as columns."""
