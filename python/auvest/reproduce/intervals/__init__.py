"""The interval policies side by side; not in a paper."""
