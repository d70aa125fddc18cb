"""``python -m auvest``: the same as the command ``auvest``."""

from auvest.cli import app

if __name__ == "__main__":
    app(prog_name="auvest")
