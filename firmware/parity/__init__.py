"""Replay programs: the same record on every target."""
