"""kill -9 at random moments: what is left is the old, the new, or a part that says so.

    python -m tests.attacks.kill --times 200

Every command that writes is started again and again on one of two small inputs, into the same
folder, and killed at a random moment of its life; after each kill all that is left is looked at.
Prints for each command how often the old and the new results were there, and how often a folder was
mixed of both, a file truncated, or a file touched that is not of the results; those must be 0.
"""

from __future__ import annotations

import argparse
import contextlib
import hashlib
import io
import json
import os
import random
import shutil
import signal
import struct
import sys
import tempfile
import threading
import time
import tty
import types
from collections import Counter
from collections.abc import Callable
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer

from auvest import montecarlo, telemetry
from auvest._outputs import MANIFEST, OLD, UNFINISHED
from auvest.cli import app
from auvest.commands import reproduce
from auvest.commands.console import discard_unpublished

#: Both inputs of every command.
VARIANTS = ("a", "b")
#: What is wrong with what is left; each must be 0.
FAULTS = ("mixed", "truncated", "foreign")
_FOREIGN = "foreign"

Tree = dict[str, str]


class Attack:
    """One command: how it is run on each input, and what its results are.

    Attributes
    ----------
    outputs : tuple of str
        The folders that it makes.
    """

    outputs: tuple[str, ...] = ("out",)

    def prepare(self, root: Path) -> None:
        """Make the inputs."""

    def run(self, root: Path, variant: str) -> None:
        """Run the command; in a process of its own."""
        raise NotImplementedError

    def judge(self, folder: Path, wanted: dict[str, Tree]) -> str:
        """Say of which input the results are, or what is wrong with them."""
        return self.verdict(digests(folder), wanted)

    @staticmethod
    def verdict(there: Tree, wanted: dict[str, Tree]) -> str:
        """Judge by the digests of all files."""
        for variant in VARIANTS:
            if there == wanted[variant]:
                return variant
        known = {digest for tree in wanted.values() for digest in tree.values()}
        return "mixed" if set(there.values()) <= known else "truncated"


class Replay(Attack):
    """`auvest replay` of two logs of one name."""

    outputs = ("out/log",)

    def prepare(self, root: Path) -> None:
        for variant, speed in zip(VARIANTS, (1.0, 2.0), strict=True):
            folder = root / variant / "log"
            folder.mkdir(parents=True)
            time_s = np.arange(0.0, 20.0)
            rows = [f"{t},{speed},0.0" for t in time_s]
            text("odometry.csv", "time_s,speed_m_s,yaw_rate_rad_s", rows, folder)
            text("beacons.csv", "source,x_m,y_m", ["1,5.0,30.0"], folder)
            text("start.csv", "time_s,x_m,y_m,heading_rad", ["0,0,0,0"], folder)
            x = speed * time_s - 5
            rows = [f"{t},1,{d:.3f}" for t, d in zip(time_s[1:], np.hypot(x, 30)[1:], strict=True)]
            text("ranges.csv", "time_s,source,range_m", rows, folder)

    def run(self, root: Path, variant: str) -> None:
        call("replay", root / variant / "log", "--output", root / "out")


class Import(Attack):
    """`auvest import` of two recordings of one set."""

    outputs = ("out/ugps_1", "out/ugps_2")

    def prepare(self, root: Path) -> None:
        for variant, place in zip(VARIANTS, (3.0, 4.0), strict=True):
            (root / variant / "ugps").mkdir(parents=True)
            for number in (1, 2):
                rows = [f"{k},1,{place + 0.1 * k:.3f},{number}" for k in range(3000)]
                name = f"fixes_{number}.csv"
                text(name, "t,valid,x_fwd,y_stbd", rows, root / variant / "ugps")

    def run(self, root: Path, variant: str) -> None:
        call("import", "ugps_pier59", root / variant / "ugps", root / "out")


class Simulate(Attack):
    """`auvest simulate aukf` with two seeds."""

    def run(self, root: Path, variant: str) -> None:
        size = ["--runs", "3", "--steps", "12", "--no-figure", "--workers", "1"]
        seed = str(VARIANTS.index(variant))
        call("simulate", "aukf", *size, "--seed", seed, "--output", root / "out")


class Reproduce(Attack):
    """What `auvest reproduce` does, with a made-up experiment of two lengths."""

    def run(self, root: Path, variant: str) -> None:
        measure = types.ModuleType("auvest.reproduce.made_up.measure")
        page = types.ModuleType("auvest.reproduce.made_up.page")

        def measured(*, runs: int = 7, progress: Any) -> int:
            progress(1, 1)
            return runs

        measure.measure = measured  # type: ignore[attr-defined]
        measure.summary = lambda runs: {"runs": runs}  # type: ignore[attr-defined]
        measure.tables = lambda runs: {"t": {"a": np.full(2000, runs)}}  # type: ignore[attr-defined]
        page.page = lambda runs: f"{runs} runs\n" * 2000  # type: ignore[attr-defined]
        made = typer.Typer()
        option = Annotated[int, typer.Option("--runs")]
        made.command()(reproduce.command(measure, page, lambda _: [], figures=False, runs=option))
        runs = str(1 + VARIANTS.index(variant))
        try:
            call("--runs", runs, "--output", root / "out", of=made)
        finally:
            discard_unpublished()  # as auvest.cli does


class Capture(Attack):
    """`auvest capture` from a pseudo-terminal on which a thread speaks as the board."""

    _COLUMNS = (
        "sample#,time_s,dt_s,range_m,bearing_rad,desired_x_m,desired_y_m,x_m,y_m,vx_m_s,vy_m_s,"
        "ax_m_s2,ay_m_s2,P00_m2,P10_m2,P11_m2,nis,interval_s,status#,missed#,refused#,late#,awake_us#"
    )
    _STEPS = 40

    def run(self, root: Path, variant: str) -> None:
        master, slave = os.openpty()
        tty.setraw(slave)
        awake_us = 100 + VARIANTS.index(variant)  # by which its rows are known

        def speak() -> None:
            for k in range(1, 100_000):
                zero, one = (struct.pack(">f", value).hex() for value in (0.0, 1.0))
                cells = [str(k), f"{0.5 * k:.6f}", *[one] * 11, one, zero, one, one, one]
                row = ",".join(["AUV", *cells, "0", "0", "0", "0", str(awake_us)])
                header = telemetry.frame(f"COLUMNS,AUV,{self._COLUMNS}")
                lines = f"{header}\r\n{telemetry.frame(row)}\r\n"
                os.write(master, lines.encode("latin-1"))
                time.sleep(1e-3)

        threading.Thread(target=speak, daemon=True).start()
        size = ["--steps", str(self._STEPS), "--no-figure", "--force"]
        call("capture", "--port", os.ttyname(slave), *size, "--output", root / "out")

    def judge(self, folder: Path, wanted: dict[str, Tree]) -> str:
        """Its times are those of the machine: the rows are counted, and known by their last."""
        del wanted
        try:
            samples = json.loads((folder / "results.json").read_text())["results"]["samples"]
            rows = (folder / "record.csv").read_text()
        except (OSError, ValueError):
            return "truncated"
        lines = rows.splitlines()[1:]
        tags = {line.rpartition(",")[2] for line in lines}
        if not rows.endswith("\n") or {line.count(",") for line in lines} != {23}:
            return "truncated"
        if len(tags) != 1 or len(lines) != samples:
            return "mixed"
        return VARIANTS[int(tags.pop()) - 100]


class Store(Attack):
    """`montecarlo.run` with a store, of two experiments by turns."""

    outputs = ("store",)

    def run(self, root: Path, variant: str) -> None:
        size = {"chunk": 2, "workers": 2, "store": root / "store"}
        montecarlo.run(lambda *chunk: self._columns(variant, *chunk), 40, settings=variant, **size)  # type: ignore[arg-type]

    def judge(self, folder: Path, wanted: dict[str, Tree]) -> str:
        """Every chunk that is there is whole, and of the experiment that the label names."""
        del wanted
        found = ""
        for path in folder.glob("*.npz"):
            first, last = map(int, path.stem.split("-"))
            try:
                with np.load(path) as arrays:
                    chunk = {name: arrays[name] for name in arrays.files}
            except Exception:
                return "truncated"
            for variant in VARIANTS:
                columns = self._columns(variant, first, last - first + 1)
                if all(np.array_equal(chunk[name], columns[name]) for name in columns):
                    if found not in ("", variant):
                        return "mixed"
                    found = variant
                    break
            else:
                return "truncated"
        return found or VARIANTS[0]

    @staticmethod
    def _columns(variant: str, first: int, count: int) -> dict[str, np.ndarray[Any, Any]]:
        return {"value": np.outer(np.arange(first, first + count), np.ones(500)) + ord(variant)}


ATTACKS: dict[str, Callable[[], Attack]] = {
    "replay": Replay,
    "import": Import,
    "simulate": Simulate,
    "reproduce": Reproduce,
    "capture": Capture,
    "store": Store,
}


def attack(name: str, times: int, seed: int, root: Path) -> Counter[str]:
    """Kill one command so many times; count what was left.

    Parameters
    ----------
    name : str
        One of ``ATTACKS``.
    times : int
        Kills.
    seed : int
        Of the moments.
    root : Path
        An empty folder to work in.
    """
    chance = random.Random(f"{name} {seed}")
    made = ATTACKS[name]()
    made.prepare(root)
    beside = {root / _FOREIGN / "notes.txt", root / "out.txt", root / "out" / "notes.txt"}
    beside -= {root / folder / "notes.txt" for folder in made.outputs}
    for path in beside:
        path.parent.mkdir(exist_ok=True)
        path.write_text("mine")
    foreign = {path: digests(path) for path in root.iterdir() if path.name in (_FOREIGN, *VARIANTS)}

    wanted: dict[str, dict[str, Tree]] = {folder: {} for folder in made.outputs}
    lasts: list[float] = []
    for variant in VARIANTS:
        lasts.append(finish(lambda v=variant: made.run(root, v), None))  # type: ignore[misc]
        for folder in made.outputs:
            wanted[folder][variant] = digests(root / folder)
    counts: Counter[str] = Counter(dict.fromkeys(FAULTS, 0))
    for _ in range(times):
        variant = chance.choice(VARIANTS)
        finish(lambda v=variant: made.run(root, v), chance.uniform(0.0, 1.1 * max(lasts)))  # type: ignore[misc]
        counts["killed"] += 1
        for folder in made.outputs:
            path, aside = root / folder, root / f"{folder}{OLD}"
            counts["unfinished"] += (root / f"{folder}{UNFINISHED}").is_dir()
            place = path if path.is_dir() else aside  # stopped between two names
            if not place.is_dir():
                counts["nothing yet"] += 1
                continue
            verdict = made.judge(place, wanted[folder])
            counts["new" if verdict == variant else "old" if verdict in VARIANTS else verdict] += 1
        touched = any(digests(path) != before for path, before in foreign.items())
        touched |= any(not path.is_file() or path.read_text() != "mine" for path in beside)
        counts["foreign"] += touched
    for variant in VARIANTS:  # and nothing that was left is in the way
        finish(lambda v=variant: made.run(root, v), None)  # type: ignore[misc]
        for folder in made.outputs:
            counts["mixed"] += made.judge(root / folder, wanted[folder]) != variant
            left = [path for path in (root / folder).parent.glob(f"*{UNFINISHED}") if path.is_dir()]
            counts["truncated"] += len(left)
    return counts


def call(*arguments: object, of: typer.Typer = app) -> None:
    """Call the command line in this process; any end but the good one is raised."""
    code = of([*map(str, arguments), "--quiet"], standalone_mode=False)
    if code:
        raise RuntimeError(f"exit code {code}")


def finish(work: Callable[[], None], killed_after_s: float | None) -> float:
    """Do the work in a fork of this process, which has imported everything; give its time, s.

    Killed after a time, if one is given. Without one a failure is ours.
    """
    began = time.monotonic()
    child = os.fork()
    if child == 0:
        code = 1
        out = io.StringIO()
        try:
            with contextlib.redirect_stdout(out), contextlib.redirect_stderr(out):
                code = int(bool(work()))
        except BaseException as error:  # the parent must not go on twice
            os.write(2, f"{type(error).__name__}: {error}\n{out.getvalue()[-2000:]}".encode())
        finally:
            os._exit(code)
    if killed_after_s is not None:
        time.sleep(killed_after_s)
        os.kill(child, signal.SIGKILL)
    _, status = os.waitpid(child, 0)
    if killed_after_s is None and status != 0:
        raise RuntimeError(f"a run that nobody has killed has failed: status {status}")
    return time.monotonic() - began


def digests(path: Path) -> Tree:
    """Give what every file below a path holds, without the manifests: they name a version."""
    return {
        str(found.relative_to(path)): hashlib.sha256(found.read_bytes()).hexdigest()
        for found in sorted(path.rglob("*"))
        if found.is_file() and found.name != MANIFEST
    }


def text(name: str, header: str, rows: list[str], folder: Path) -> None:
    (folder / name).write_text("\n".join([header, *rows, ""]))


def main() -> int:
    """Attack from the command line; 1 if anything was found."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--times", type=int, default=20, help="kills of each command (20)")
    parser.add_argument("--seed", type=int, default=1, help="of the moments (1)")
    parser.add_argument(
        "names", nargs="*", help=f"of {', '.join(ATTACKS)}; store is that of Monte Carlo runs (all)"
    )
    given = parser.parse_args()
    for name in given.names:
        if name not in ATTACKS:
            parser.error(f"no command {name!r}: there are {', '.join(ATTACKS)}")
    wrong = 0
    for name in given.names or ATTACKS:
        root = Path(tempfile.mkdtemp(prefix=f"auvest-kill-{name}-"))
        counts = attack(name, given.times, given.seed, root)
        shutil.rmtree(root)
        print(
            f"{name}: {', '.join(f'{count} {what}' for what, count in counts.items())}", flush=True
        )
        wrong += sum(counts[fault] for fault in FAULTS)
    return int(wrong > 0)


if __name__ == "__main__":
    sys.exit(main())
