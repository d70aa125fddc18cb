"""What all commands share: where output goes, exit codes, progress.

Results go to stdout, everything else to stderr. With ``--json`` stdout holds one JSON object and
nothing else. ``--quiet`` leaves only errors on stderr.
"""

from __future__ import annotations

import json
import math
import sys
from collections.abc import Callable, Container, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any, NoReturn

import typer
from rich.console import Console, RenderableType
from rich.markup import escape
from rich.progress import (
    BarColumn,
    MofNCompleteColumn,
    Progress,
    ProgressColumn,
    TextColumn,
    TimeRemainingColumn,
)
from rich.table import Table
from rich.text import Text

from auvest._outputs import NewFolder, OutputError
from auvest.commands.exit_codes import ExitCode

#: ``progress(done, total)``, called now and then by long work.
ProgressCallback = Callable[[int, int], None]

#: Folders of results that are being made.
_being_made: list[NewFolder] = []


def discard_unpublished() -> None:
    """Remove what a command has begun to write and not finished; the results before it stay."""
    while _being_made:
        new = _being_made.pop()
        new.discard()
        if new.left is not None:
            typer.echo(f"Note: what was recorded is in {shown(new.left)}", err=True)


class _Progress(Progress):
    """A bar, and what is drawn above it."""

    def __init__(
        self, *columns: ProgressColumn, view: Callable[[], RenderableType] | None, **options: Any
    ) -> None:
        self._view = view
        super().__init__(*columns, **options)

    def get_renderables(self) -> Iterable[RenderableType]:
        if self._view is not None:
            yield self._view()
        yield from super().get_renderables()


class Terminal:
    """Where a command writes: results to stdout, errors and progress to stderr."""

    def __init__(self, *, as_json: bool, quiet: bool) -> None:
        self.as_json = as_json
        for stream in (sys.stdout, sys.stderr):  # a name may hold what the console cannot show
            if hasattr(stream, "reconfigure"):
                stream.reconfigure(errors="backslashreplace")
        self._out = Console(highlight=False, soft_wrap=True)
        self._err = Console(stderr=True, highlight=False, soft_wrap=True)
        self._messages = Console(stderr=True, highlight=False, soft_wrap=True, quiet=quiet)

    def result(self, renderable: Any) -> None:
        """Print a result for a human, text as it is; with ``--json`` nothing."""
        if not self.as_json:
            self._out.print(Text(renderable) if isinstance(renderable, str) else renderable)

    def result_json(self, value: dict[str, Any]) -> None:
        """Print the one JSON object, if it was asked for."""
        if self.as_json:
            typer.echo(to_json(value))

    def files(self, files: Mapping[str, Path]) -> None:
        """Print for a human what was written."""
        for name, path in files.items():
            self.result(f"{name.replace('_', ' '):9} {shown(path)}")

    def warn(self, message: str) -> None:
        """Print one line on stderr, unless quiet."""
        self._messages.print(f"[bold yellow]Note:[/] {escape(shown(message, lines=True))}")

    def fail(self, message: str, code: ExitCode) -> NoReturn:
        """Print one line on stderr and end."""
        self._err.print(f"[bold red]Error:[/] {escape(shown(message, lines=True))}")
        raise typer.Exit(int(code))

    @property
    def shows_bars(self) -> bool:
        """Whether stderr can show the letters that bars are drawn with."""
        return not self._messages.options.ascii_only

    @contextmanager
    def progress(
        self, what: str, view: Callable[[], RenderableType] | None = None
    ) -> Iterator[ProgressCallback]:
        """Show a bar on stderr that is gone when the work is done, if it is a terminal.

        ``view`` is drawn above it, some ten times a second.
        """
        columns = (
            TextColumn("{task.description}"),
            BarColumn(),
            MofNCompleteColumn(),
            TimeRemainingColumn(),
        )
        hidden = self._messages.quiet or not self._messages.is_terminal
        options: dict[str, Any] = {"console": self._messages, "transient": True, "disable": hidden}
        with _Progress(*columns, view=view, **options) as bar:
            task = bar.add_task(what, total=None)
            yield lambda done, total: bar.update(task, completed=done, total=total)

    @contextmanager
    def usage_errors(self) -> Iterator[None]:
        """Turn the library's own checks of arguments into one line, exit code 2."""
        try:
            yield
        except (ValueError, TypeError) as error:
            self.fail(str(error), ExitCode.USAGE)

    def new_folder(
        self, folder: Path, command: str, *, force: bool = False, precious: bool = False
    ) -> NewFolder:
        """Begin a folder of results before the work, so that a wrong one is known at once.

        Parameters are those of :class:`auvest._outputs.NewFolder`; unless it is published, nothing
        of it is left when the command ends.
        """
        try:
            new = NewFolder(folder, command, force=force, precious=precious)
        except OutputError as error:
            self.fail(f"--output: {error}", ExitCode.USAGE)
        except OSError as error:
            file = next((one for one in folder.parents if one.exists() and not one.is_dir()), None)
            why = f"cannot write there: {error.strerror or error}"
            if file is not None:
                why = f"{file} is a file, not a folder"
            self.fail(f"--output {folder}: {why}", ExitCode.FAILED)
        _being_made.append(new)
        return new

    def publish(self, new: NewFolder, *, interrupted: bool = False) -> None:
        """Give a folder of results its name, and say where a folder that was there went."""
        with self.writing(new.path):
            try:
                new.publish(interrupted=interrupted)
            except OutputError as error:
                self.fail(f"--output: {error}; the results are in {new.part}", ExitCode.FAILED)
        if new.kept is not None:
            self.warn(f"what was in {new.path} is now in {new.kept}")

    @contextmanager
    def writing(self, folder: Path) -> Iterator[None]:
        """Turn a full disk and the like into one line, exit code 1."""
        try:
            yield
        except OSError as error:
            self.fail(f"cannot write to {folder}: {error.strerror or error}", ExitCode.FAILED)


def shown(text: object, *, lines: bool = False) -> str:
    """Give a name as it can be shown: what cannot be printed is written as in Python.

    ``lines``: it is a message, whose line breaks are wanted.
    """
    return "".join(
        letter
        if letter.isprintable() or (lines and letter == "\n")
        else letter.encode("unicode_escape", "surrogatepass").decode("ascii")
        for letter in str(text)
    )


def table(
    title: str, header: Sequence[str], rows: Iterable[Sequence[str]], right: Container[int] = ()
) -> Table:
    """Make a table; ``right`` are the columns that are flush right."""
    made = Table(title=Text(shown(title)), title_justify="left", title_style="bold")
    for number, name in enumerate(header):
        made.add_column(name, justify="right" if number in right else "left", overflow="fold")
    for row in rows:
        made.add_row(*map(Text, row))
    return made


def to_json(value: Any) -> str:
    """JSON with NaN and infinity as null, and keys in their own order."""
    return json.dumps(_plain(value), indent=2, allow_nan=False)


def _plain(value: Any) -> Any:
    if isinstance(value, dict):
        return {str(key): _plain(item) for key, item in value.items()}
    if hasattr(value, "tolist"):
        return _plain(value.tolist())
    if isinstance(value, (list, tuple)):
        return [_plain(item) for item in value]
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value
