"""Real recordings through the filters."""
