"""auvest on a microcontroller: the Arduino library, sketches, the simulated board."""
