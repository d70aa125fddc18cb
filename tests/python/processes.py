"""Programs that tests start, interrupt and wait for: on any machine, from any shell."""

from __future__ import annotations

import signal
import subprocess
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

#: What only a program that hangs takes, s: an end for the test, no bound on the speed of a machine.
PATIENCE_S = 900.0


def start_program(command: list[Any], **options: Any) -> subprocess.Popen[str]:
    """Start a program that an interrupt reaches; its stdout and stderr are pipes of text.

    A process hands an ignored signal on to its children, and the tests may run under ``nohup`` or
    in the background of a shell, where SIGINT is ignored.
    """
    return subprocess.Popen(
        [str(part) for part in command],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),
        **options,
    )


def wait_until(
    condition: Callable[[], bool], what: str, program: subprocess.Popen[str] | None = None
) -> None:
    """Return when the condition holds; fail if the program that should see to it has ended."""
    deadline = time.monotonic() + PATIENCE_S
    while not condition():
        assert time.monotonic() < deadline, f"after {PATIENCE_S:g} s: {what}"
        if program is not None and program.poll() is not None and not condition():
            raise AssertionError(f"{what}: exit code {program.returncode}\n{program.communicate()}")
        time.sleep(0.01)


def lines_of(path: Path) -> int:
    """Count the lines of a file; none if it is not there yet."""
    return len(path.read_text(encoding="utf-8").splitlines()) if path.exists() else 0
