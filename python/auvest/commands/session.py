"""What the commands have in common that run something and keep what was done: simulate, capture."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, NoReturn, TypeAlias, TypeVar

import numpy as np
import numpy.typing as npt
from rich.table import Table

from auvest import Status
from auvest._texts import counted
from auvest.commands.console import Terminal
from auvest.commands.exit_codes import ExitCode
from auvest.commands.files import write_csv, write_results
from auvest.commands.version import version

if TYPE_CHECKING:
    from matplotlib.figure import Figure

R = TypeVar("R")
Floats: TypeAlias = npt.NDArray[np.float64]


class Session:
    """What happens from the first run to the exit code.

    Parameters
    ----------
    terminal : Terminal
        Where to write.
    output : Path
        The folder for the results, made as :class:`auvest._outputs.NewFolder` says.
    command : str
        The words after ``auvest``.
    settings : dict
        What the results depend on, for results.json.
    force, precious : bool
        As for :class:`auvest._outputs.NewFolder`.

    Attributes
    ----------
    part : Path
        Where to write files of one's own.
    ----------
    interrupted : bool
        Ctrl-C came before all was done.
    trouble : str
        What else ended it before all was done.
    files : dict of str to Path
        What was written, by its name on the terminal: where it is at the end.
    """

    def __init__(
        self,
        terminal: Terminal,
        output: Path,
        command: str,
        settings: dict[str, Any],
        *,
        force: bool = False,
        precious: bool = False,
    ) -> None:
        self.interrupted = False
        self.trouble = ""
        self.files: dict[str, Path] = {}
        self._terminal = terminal
        self._output = output
        self._head = {"command": command, "version": version(), "settings": settings}
        self._folder = terminal.new_folder(output, command, force=force, precious=precious)
        self.part = self._folder.part

    def run(self, simulate: Callable[..., R], *arguments: Any, **options: Any) -> R:
        """Do the runs; after Ctrl-C return those that are done, end if there are none."""
        done = self.run_some(simulate, *arguments, **options)
        return self.nothing_done() if done is None else done

    def run_some(
        self, simulate: Callable[..., R], *arguments: Any, what: str = "runs", **options: Any
    ) -> R | None:
        """Do the runs; after Ctrl-C return those that are done, None if there are none."""
        with self._terminal.progress(what) as progress:
            try:
                return simulate(*arguments, progress=progress, **options)
            except KeyboardInterrupt as stop:
                self.interrupted = True
                return getattr(stop, "partial", None)

    def nothing_done(self) -> NoReturn:
        """End after Ctrl-C before the first run was done."""
        self._terminal.fail("interrupted: no run was done", ExitCode.INTERRUPTED)

    def write_csv(self, name: str, columns: Mapping[str, npt.NDArray[Any]]) -> None:
        """Write a table of the results."""
        with self._terminal.writing(self._output):
            self.add(name, write_csv(self.part / f"{name}.csv", columns))

    def add(self, name: str, path: Path) -> None:
        """Name a file that was written."""
        self.files[name] = self._output / path.name

    def draw(self, figure: Callable[..., Figure], *arguments: Any) -> None:
        """Draw the figure of the results."""
        from auvest import plots  # here, because matplotlib takes long to import

        with self._terminal.writing(self._output), plots.own_style():
            self.add("figure", plots.save(figure(*arguments), self.part / "figure.png"))

    def report(self, results: dict[str, Any], table: Table, **more: Any) -> None:
        """Write results.json, give the folder its name, and print what was asked for."""
        complete = not (self.interrupted or self.trouble)
        document = {**self._head, "complete": complete, "results": results, **more}
        self.files["results"] = self._output / "results.json"
        document["files"] = {name: str(path) for name, path in self.files.items()}
        with self._terminal.writing(self._output):
            write_results(self.part, document)
        self._terminal.publish(self._folder, interrupted=not complete)
        self._terminal.result_json(document)
        self._terminal.result(table)
        self._terminal.files(self.files)

    def end(self, kept: str, *failures: str) -> None:
        """End with what was interrupted or failed, if anything was."""
        if self.interrupted:
            self._terminal.fail(f"interrupted: {kept}", ExitCode.INTERRUPTED)
        for text in filter(None, failures):
            self._terminal.fail(text, ExitCode.FAILED)


def failure(result: Any, of: str = "") -> str:
    """Say how many runs failed, and how the first did; nothing if none did."""
    failed = np.flatnonzero(result.failed)
    if not failed.size:
        return ""
    first = int(failed[0])
    steps = ""
    if hasattr(result, "samples"):
        steps = f", after {counted(int(result.samples[first]), 'step')}"
    return (
        f"{failed.size} of {counted(len(result.status), 'run')}{of} failed; the first, run "
        f"{first}{steps}: {Status(int(result.status[first])).name}"
    )


def mean_over_runs(values: Floats) -> Floats:
    """Mean of each column over the rows that are known there; NaN where none is."""
    known = np.isfinite(values)
    count = known.sum(axis=0)
    total = np.where(known, values, 0.0).sum(axis=0)
    return np.where(count > 0, total / np.maximum(count, 1), np.nan)
