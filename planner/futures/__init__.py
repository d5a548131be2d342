"""Recorded SUMO trajectories of the particles."""
