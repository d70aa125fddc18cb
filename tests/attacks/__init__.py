"""Random attacks with counts: on the Python interface, saved states, logs, importers; long runs."""
