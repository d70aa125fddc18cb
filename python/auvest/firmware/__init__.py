"""Firmware from the desk: the Arduino library, sketches, the simulated board, what a filter costs.

The sources of the library and of the board come with the package.
"""
