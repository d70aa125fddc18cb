"""The frame of the attacks: cases from a seed, counts, progress, and failures made small.

An attack makes a case from random numbers, a subject and steps, and runs it. Case k of a seed is
always the same, so that one that kills the process can be told by its number. A failing case loses
steps for as long as it goes on failing in the same way; what is left is printed.
"""

from __future__ import annotations

import argparse
import json
import multiprocessing
import random
import sys
import time
import traceback
from collections import Counter
from collections.abc import Callable, Collection
from dataclasses import dataclass, field, replace
from typing import Any, Protocol

#: A case that takes longer hangs, s.
HANGS_S = 60.0
_TELLS_S = 0.5
_PROGRESS_S = 30.0


@dataclass(frozen=True)
class Case:
    """What is attacked, and how, step by step."""

    subject: Any
    steps: tuple[Any, ...]


class Failed(Exception):
    """The case broke a promise: `kind` says which, without numbers; `detail` how."""

    def __init__(self, kind: str, detail: str) -> None:
        super().__init__(f"{kind}: {detail}")
        self.kind, self.detail = kind, detail


class Attack(Protocol):
    """What an attack is."""

    #: What is counted towards the number that was asked for.
    unit: str

    def case(self, rng: random.Random) -> Case:
        """Make a case; nothing is run."""

    def run(self, case: Case, counts: Counter[str]) -> None:
        """Run a case and count what became of it; raise Failed where a promise is broken."""

    def text(self, case: Case) -> str:
        """Write a case so that it can be run by hand."""


@dataclass
class Result:
    """Counts, and by kind of failure the smallest case and how often it came."""

    counts: Counter[str] = field(default_factory=Counter)
    failures: dict[str, str] = field(default_factory=dict)
    times: Counter[str] = field(default_factory=Counter)
    cases: int = 0
    seconds: float = 0.0

    def fail(self, kind: str, text: str) -> None:
        self.times[kind] += 1
        if kind not in self.failures:
            self.failures[kind] = text
            print(f"--- {kind}\n{text}", flush=True)


def numbered(attack: Attack, seed: int, number: int) -> Case:
    """Case `number` of a seed."""
    return attack.case(random.Random(f"{seed}/{number}"))


def smaller(attack: Attack, case: Case, failed: Failed) -> tuple[Case, Failed]:
    """Leave out steps for as long as the case fails in the same way."""
    at = len(case.steps)
    while at > 0:
        at -= 1
        shorter = replace(case, steps=case.steps[:at] + case.steps[at + 1 :])
        try:
            attack.run(shorter, Counter())
        except Failed as again:
            if again.kind == failed.kind:
                case, failed, at = shorter, again, min(at, len(shorter.steps))
    return case, failed


def run(
    attack: Attack,
    amount: int,
    seed: int,
    *,
    first: int = 0,
    known: Collection[str] = (),
    tell: Callable[[int, Result], None] | None = None,
) -> Result:
    """Run cases from `first` on until `amount` units are done, in this process.

    Failures of a kind that is known are only counted. `tell` is called before each case.
    """
    result, began, number = Result(), time.monotonic(), first
    while result.counts[attack.unit] < amount:
        result.cases, result.seconds = number - first, time.monotonic() - began
        if tell is not None:
            tell(number, result)
        case = numbered(attack, seed, number)
        try:
            attack.run(case, result.counts)
        except Failed as failed:
            if failed.kind in result.failures or failed.kind in known:
                result.times[failed.kind] += 1
            else:
                case, failed = smaller(attack, case, failed)
                where = f"# seed {seed}, case {number}"
                result.fail(failed.kind, f"{where}\n{attack.text(case)}\n# {failed.detail}")
        number += 1
    result.cases, result.seconds = number - first, time.monotonic() - began
    return result


def run_apart(attack: Attack, amount: int, seed: int) -> Result:
    """Run cases in a process of their own: a crash or a hang is a failure like others."""
    total, first = Result(), 0
    while total.counts[attack.unit] < amount:
        worker = _Worker(attack, amount - total.counts[attack.unit], seed, first, total.failures)
        ended = worker.wait()
        found = worker.latest
        total.counts += found.counts
        total.times += found.times
        total.failures = {**found.failures, **total.failures}
        total.seconds += found.seconds
        if ended == "":
            total.cases += found.cases
            break
        lost = worker.number.value
        text = attack.text(numbered(attack, seed, lost))
        total.fail(ended, f"# seed {seed}, case {lost}\n{text}")
        total.cases += lost - first + 1
        first = lost + 1
    return total


class _Worker:
    """A process that runs cases; what it had found when it last said so is `latest`."""

    def __init__(
        self, attack: Attack, amount: int, seed: int, first: int, known: Collection[str]
    ) -> None:
        context = multiprocessing.get_context("fork")
        self.number, self._queue = context.Value("q", first), context.SimpleQueue()
        self._done = context.Value("q", 0)
        self.latest, self._unit = Result(), attack.unit

        def work() -> None:
            told = shown = time.monotonic()

            def tell(number: int, result: Result) -> None:
                nonlocal told, shown
                self.number.value, self._done.value = number, result.counts[attack.unit]
                now = time.monotonic()
                if now - told > _TELLS_S:
                    told = now
                    self._queue.put(result)
                if now - shown > _PROGRESS_S:
                    shown = now
                    done = result.counts[attack.unit]
                    print(f"{done} of {amount} {attack.unit}", file=sys.stderr)

            try:
                options = {"first": first, "known": frozenset(known), "tell": tell}
                self._queue.put(run(attack, amount, seed, **options))  # type: ignore[arg-type]
                self._queue.put("")
            except BaseException:
                self._queue.put(traceback.format_exc())

        self._process = context.Process(target=work)
        self._process.start()

    def wait(self) -> str:
        """Say how it ended: "" if it did all."""
        seen, since = self.number.value, time.monotonic()
        while True:
            while not self._queue.empty():
                said = self._queue.get()
                if isinstance(said, Result):
                    self.latest = said
                    continue
                self._process.join()
                if said:
                    raise RuntimeError(f"the attack itself failed\n{said}")
                return ""
            if not self._process.is_alive() and self._queue.empty():
                self.latest.counts[self._unit] = self._done.value
                return f"crash: the process ended with {self._process.exitcode}"
            if self.number.value != seen:
                seen, since = self.number.value, time.monotonic()
            elif time.monotonic() - since > HANGS_S:
                self._process.kill()
                self._process.join()
                self.latest.counts[self._unit] = self._done.value
                return f"hang: longer than {HANGS_S:.0f} s"
            time.sleep(0.05)


def main(attack: Attack, doc: str | None, amount: int) -> None:
    """The command: prints counts as JSON; exit code 1 if a promise was broken."""
    parser = argparse.ArgumentParser(description=(doc or "").splitlines()[0])
    parser.add_argument(f"--{attack.unit}", type=int, default=amount, dest="amount")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--case", type=int, help="run only this case of the seed")
    given = parser.parse_args()
    if given.case is not None:
        case = numbered(attack, given.seed, given.case)
        print(attack.text(case))
        attack.run(case, Counter())
        return
    result = run_apart(attack, given.amount, given.seed)
    rows = {
        "seed": given.seed,
        "cases": result.cases,
        "seconds": round(result.seconds),
        **dict(sorted(result.counts.items())),
        "failures": dict(result.times),
    }
    print(json.dumps(rows, indent=1))
    sys.exit(1 if result.failures else 0)
