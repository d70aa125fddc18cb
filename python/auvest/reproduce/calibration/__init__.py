"""Noises ten times off, and what calibration makes of them."""
