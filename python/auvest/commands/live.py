"""A recording while it grows: a page on this computer, and a few lines in the terminal."""

from __future__ import annotations

import json
import math
import threading
from collections.abc import Sequence
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from importlib import resources
from typing import Any, Protocol
from urllib.parse import parse_qs, urlsplit

from rich.table import Table
from rich.text import Text

from auvest.telemetry import Row

_BARS = "▁▂▃▄▅▆▇█"
#: Samples that the terminal draws.
_DRAWN = 40


class Growing(Protocol):
    """What is drawn: rows with the same columns, to which others are appended."""

    rows: list[Row]
    damaged: int


class LivePage:
    """Serves a page that draws a recording, to browsers of this computer only.

    Use as a context manager; ``url`` says where it is.

    Parameters
    ----------
    recording : Growing
        Is read as often as the page asks for what is new.
    title : str
        Of the page.
    """

    def __init__(self, recording: Growing, title: str) -> None:
        page = resources.files("auvest.commands").joinpath("live.html").read_bytes()

        class Handler(BaseHTTPRequestHandler):
            """Two addresses: the page, and the rows from a number on."""

            def do_GET(self) -> None:
                asked = urlsplit(self.path)
                since = parse_qs(asked.query).get("since", ["0"])[0]
                # A page from elsewhere that has itself resolved to here sends its own name.
                if self.headers.get("Host", "") not in hosts:
                    self.send_error(403)
                elif asked.path == "/":
                    self._answer("text/html; charset=utf-8", page)
                elif asked.path == "/rows" and since.isdecimal() and len(since) < 10:
                    rows = rows_since(recording, int(since), title)
                    self._answer("application/json", json.dumps(rows).encode())
                else:
                    self.send_error(404)

            def _answer(self, kind: str, body: bytes) -> None:
                self.send_response(200)
                self.send_header("Content-Type", kind)
                self.send_header("Content-Length", str(len(body)))
                self.send_header("Cache-Control", "no-store")
                self.end_headers()
                self.wfile.write(body)

            def log_message(self, format: str, *arguments: object) -> None:  # noqa: A002
                """Say nothing: the terminal is for the recording."""

        self._server = ThreadingHTTPServer(("127.0.0.1", 0), Handler)
        port = self._server.server_address[1]
        hosts = (f"127.0.0.1:{port}", f"localhost:{port}")
        self.url = f"http://{hosts[0]}/"

    def __enter__(self) -> LivePage:
        threading.Thread(target=self._server.serve_forever, args=(0.1,), daemon=True).start()
        return self

    def __exit__(self, *_: object) -> None:
        self._server.shutdown()
        self._server.server_close()


def rows_since(recording: Growing, since: int, title: str) -> dict[str, Any]:
    """Give what a page that has `since` rows does not have yet; None stands for what is missing."""
    rows = recording.rows[since:]
    first = recording.rows[0] if recording.rows else {}
    return {
        "title": title,
        "columns": list(first),
        "rows": [
            [
                value if math.isfinite(value) else None
                for value in (row.get(n, math.nan) for n in first)
            ]
            for row in rows
        ],
        "sections": int(recording.rows[-1]["section"]) if recording.rows else 1,
        "damaged": recording.damaged,
    }


def terminal_view(recording: Growing, *, bars: bool) -> Table | Text:
    """Draw the last samples: a line per column, its last number and, with ``bars``, its course."""
    rows = recording.rows[-_DRAWN:]
    if not rows:
        return Text("waiting for the first sample")
    made = Table(box=None, show_header=False, padding=(0, 2, 0, 0))
    for name in rows[-1]:
        if name == "section":
            continue
        values = [row.get(name, math.nan) for row in rows]
        last = f"{values[-1]:.6g}" if math.isfinite(values[-1]) else "missing"
        made.add_row(Text(name), Text(last, justify="right"), Text(course(values) if bars else ""))
    return made


def course(values: Sequence[float]) -> str:
    """Draw numbers as a row of bars, a blank where one is missing."""
    known = [value for value in values if math.isfinite(value)]
    if not known:
        return " " * len(values)
    low, high = min(known), max(known)
    step = (high - low) / (len(_BARS) - 1) or 1.0
    return "".join(
        _BARS[round((value - low) / step)] if math.isfinite(value) else " " for value in values
    )
