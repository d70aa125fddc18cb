"""A binary file from its beginning to its end, a piece at a time, with the place of each."""

from __future__ import annotations

from pathlib import Path

from auvest.importers.recording import opened


class Cut(Exception):
    """The file ends within a message."""


class Bytes:
    """Reads on and on; ``at`` is where the next byte stands.

    Parameters
    ----------
    path : Path
        The file.
    """

    def __init__(self, path: Path) -> None:
        self._file = opened(path)
        self._left = b""
        self.at = 0

    def __enter__(self) -> Bytes:
        return self

    def __exit__(self, *_: object) -> None:
        self._file.close()

    def take(self, count: int) -> bytes:
        """Give the next bytes.

        Raises
        ------
        Cut
            If there are fewer; none are then taken.
        """
        piece = self.peek(count)
        if len(piece) < count:
            raise Cut
        self._left = self._left[count:]
        self.at += count
        return piece

    def peek(self, count: int) -> bytes:
        """Look at the next bytes, or as many as there are."""
        if len(self._left) < count:
            self._left += self._file.read(max(count, 1 << 16) - len(self._left))
        return self._left[:count]

    @property
    def where(self) -> str:
        """The place of the next byte."""
        return f"byte {self.at}"
