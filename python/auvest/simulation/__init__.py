"""Vehicles in simulation: hull, sensors, and the loop that steers."""
