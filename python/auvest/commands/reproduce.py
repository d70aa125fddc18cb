"""``auvest reproduce``: what its commands have in common.

Each is made of a folder in :mod:`auvest.reproduce`; its ``command.py`` calls :func:`command`.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from importlib import import_module
from inspect import Parameter, Signature, signature
from pathlib import Path
from types import ModuleType
from typing import Any

from rich.table import Table

from auvest._texts import counted
from auvest.commands import console, options
from auvest.commands.console import Terminal
from auvest.commands.exit_codes import ExitCode
from auvest.commands.files import save_figures, write_page
from auvest.commands.version import version


def command(
    measure: ModuleType,
    page: ModuleType,
    shown: Callable[[Any], Iterable[Table]],
    *,
    claims: ModuleType | None = None,
    figures: bool = True,
    **annotations: Any,
) -> Callable[..., None]:
    """Make a command.

    Parameters
    ----------
    measure : module
        ``measure(**options, progress=...)`` runs the experiments; ``summary(result)`` is their
        JSON and ``tables(result)``, if there is one, their CSV files. A result may have
        ``failed_runs``, a number, and ``unfinished``, what it holds if it was interrupted.
        ``check(**options)``, if there is one, refuses options before anything is written.
    page : module
        ``page(result)`` is README.md.
    shown : callable
        Makes the tables for the terminal.
    claims : module, optional
        ``claims(result)`` judges what was claimed.
    figures : bool
        Whether there is a module ``figures`` with ``FIGURES``. It imports matplotlib, which takes
        long, and is imported when it is time to draw.
    **annotations
        The options besides those of every command, by the names of the parameters of
        ``measure.measure``, which has their defaults.
    """
    package = page.__name__.rpartition(".")[0]
    name = package.rpartition(".")[2].replace("_", "-")

    def run(*, output: Path, force: bool, as_json: bool, quiet: bool, **given: Any) -> None:
        terminal = Terminal(as_json=as_json, quiet=quiet)
        if hasattr(measure, "check"):
            with terminal.usage_errors():
                measure.check(**given)
        folder = terminal.new_folder(output, f"reproduce {name}", force=force)
        done: list[Path] = []
        try:
            with terminal.progress("experiments") as progress, terminal.usage_errors():
                result = measure.measure(**given, progress=progress)
            document = {
                "command": f"reproduce {name}",
                "version": version(),
                **measure.summary(result),
            }
            if claims is not None:
                document["claims"] = [claim.as_dict() for claim in claims.claims(result)]
            tables = measure.tables(result) if hasattr(measure, "tables") else {}
            with terminal.writing(output):
                write_page(folder.part, document, tables, page.page(result), done)
            if figures:
                drawn = import_module(f"{package}.figures").FIGURES
                with terminal.progress("figures") as progress, terminal.writing(output):
                    save_figures(folder.part, drawn, result, progress, done)
        except KeyboardInterrupt:
            if done:
                terminal.publish(folder, interrupted=True)
            terminal.fail(
                f"interrupted: {len(done)} files are written to {output}", ExitCode.INTERRUPTED
            )
        unfinished = getattr(result, "unfinished", "")
        terminal.publish(folder, interrupted=bool(unfinished))
        if unfinished:
            terminal.fail(
                f"interrupted: {unfinished} are written to {console.shown(output)}",
                ExitCode.INTERRUPTED,
            )
        terminal.result_json(document)
        for table in shown(result):
            terminal.result(table)
        terminal.result(f"page      {console.shown(output / 'README.md')}")
        if figures:
            pictures = ", ".join(path.name for path in done if path.suffix == ".png")
            terminal.result(f"figures   {console.shown(output / pictures)}")
        terminal.result(f"results   {console.shown(output / 'results.json')}")
        failed = getattr(result, "failed_runs", 0)
        if failed:
            terminal.fail(f"{counted(failed, 'run')} failed; numbers are missing", ExitCode.FAILED)

    return with_options(run, measure.measure, Path(f"auvest-output/reproduce-{name}"), annotations)


def with_options(
    function: Callable[..., None],
    defaults: Callable[..., Any],
    folder: Path,
    annotations: dict[str, Any],
) -> Callable[..., None]:
    """Give a function the signature from which typer makes these options and those of all."""
    known = signature(defaults).parameters
    wanted = {name: (option, known[name].default) for name, option in annotations.items()}
    wanted["output"] = (options.Output, folder)
    wanted["force"] = (options.Force, False)
    wanted.update(as_json=(options.Json, False), quiet=(options.Quiet, False))
    function.__annotations__ = {name: option for name, (option, _) in wanted.items()}
    function.__signature__ = Signature(  # type: ignore[attr-defined]
        [
            Parameter(name, Parameter.KEYWORD_ONLY, annotation=option, default=default)
            for name, (option, default) in wanted.items()
        ]
    )
    return function
