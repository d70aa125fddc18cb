"""What instruments are off by: found, and what it costs to look where there is nothing."""
