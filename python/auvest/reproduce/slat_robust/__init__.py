"""SLAT filters that know how far off they are, and come back."""
