"""The commands of ``auvest``, one module each; :mod:`auvest.cli` hangs them into one tree."""
