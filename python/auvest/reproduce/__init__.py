"""Papers reproduced: every figure and claim beside what this package measures."""
