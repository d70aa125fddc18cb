"""What ``auvest reproduce`` measures, a folder each.

``measure.py`` runs the experiments and reduces them to numbers, ``claims.py`` judges them,
``page.md`` is the page with places for numbers that ``page.py`` fills, ``figures.py`` draws,
``command.py`` says which options there are and what is shown on the terminal.
"""
