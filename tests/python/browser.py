"""A real browser for the pages that are written or served."""

from __future__ import annotations

import os
import shutil
import subprocess
from pathlib import Path

import pytest
from processes import PATIENCE_S


def dom_of(url: str, folder: Path, *, wait: bool = True) -> tuple[str, str]:
    """Open a page without a network: its elements after 10 s of its own time, and what was said.

    Without ``wait`` the elements as soon as it has loaded, and its clock is the world's.
    """
    found = shutil.which("chromium") or shutil.which("chromium-browser")
    if found is None:
        pytest.fail("no browser: apt-get install chromium (make setup-dev installs it)")
    command = [
        found, "--headless", "--no-sandbox", "--disable-gpu", "--disable-dev-shm-usage",
        f"--user-data-dir={folder / 'profile'}",
        "--host-resolver-rules=MAP * ~NOTFOUND, EXCLUDE 127.0.0.1",
        *(["--virtual-time-budget=10000"] if wait else []), "--dump-dom", url,
    ]  # fmt: skip
    done = subprocess.run(
        command, capture_output=True, text=True, timeout=PATIENCE_S, check=True,
        env={**os.environ, "HOME": str(folder)},
    )  # fmt: skip
    return done.stdout, done.stderr
