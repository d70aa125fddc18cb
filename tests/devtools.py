"""A tab of a real browser, driven over DevTools' pipe: what a page does, says and asks for."""

from __future__ import annotations

import base64
import json
import os
import shutil
import subprocess
import time
from pathlib import Path
from typing import Any

import pytest

#: What only a page that hangs takes, s.
PATIENCE_S = 300.0


class Tab:
    """Chromium without a window and without a network, with one page open.

    Parameters
    ----------
    folder : Path
        For its profile.
    width, height : int
        Of the page, in its pixels.

    Attributes
    ----------
    requests : list of str
        Addresses of everything that the page has asked for.
    trouble : list of str
        Exceptions, and what the page and the browser have said on the console.
    """

    def __init__(self, folder: Path, *, width: int = 1280, height: int = 900) -> None:
        found = shutil.which("chromium") or shutil.which("chromium-browser")
        if found is None:
            pytest.fail("no browser: apt-get install chromium (make setup-dev installs it)")
        self.requests: list[str] = []
        self.trouble: list[str] = []
        self._ids = 0
        self._waiting = b""
        to_browser, self._to = os.pipe()
        self._from, from_browser = os.pipe()
        # The browser reads its commands from 3 and writes to 4; bash puts the pipes there.
        command = [
            "bash", "-c", f'exec "$@" 3<&{to_browser} 4>&{from_browser}', "chromium",
            found, "--headless", "--no-sandbox", "--disable-gpu", "--disable-dev-shm-usage",
            "--remote-debugging-pipe", f"--user-data-dir={folder / 'profile'}",
            "--host-resolver-rules=MAP * ~NOTFOUND", "about:blank",
        ]  # fmt: skip
        self._process = subprocess.Popen(
            command, pass_fds=(to_browser, from_browser), stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
            env={**os.environ, "HOME": str(folder)},
        )  # fmt: skip
        os.close(to_browser)
        os.close(from_browser)
        target = self.call("Target.createTarget", session=None, url="about:blank")["targetId"]
        attached = self.call("Target.attachToTarget", session=None, targetId=target, flatten=True)
        self._session = attached["sessionId"]
        for domain in ("Page", "Runtime", "Network", "Log"):
            self.call(f"{domain}.enable")
        self.resize(width, height)

    def __enter__(self) -> Tab:
        return self

    def __exit__(self, *_: object) -> None:
        os.close(self._to)
        self._process.kill()
        self._process.wait()
        os.close(self._from)

    _session: str | None = None
    _loaded = False

    def call(self, method: str, session: str | None = "own", **params: Any) -> Any:
        """Call a method of DevTools."""
        self._ids += 1
        message: dict[str, Any] = {"id": self._ids, "method": method, "params": params}
        if session is not None and self._session is not None:
            message["sessionId"] = self._session
        os.write(self._to, json.dumps(message).encode() + b"\0")
        while True:
            answer = self._read()
            if answer.get("id") == self._ids:
                if "error" in answer:
                    raise RuntimeError(f"{method}: {answer['error']['message']}")
                return answer["result"]

    def open(self, url: str) -> None:
        """Go to a page, and wait until it has loaded."""
        self._loaded = False
        self.call("Page.navigate", url=url)
        while not self._loaded:
            self._read()

    def resize(self, width: int, height: int, *, phone: bool = False) -> None:
        """Give the page another size."""
        self.call(
            "Emulation.setDeviceMetricsOverride",
            width=width, height=height, deviceScaleFactor=2 if phone else 1, mobile=phone,
        )  # fmt: skip

    def evaluate(self, script: str) -> Any:
        """Value of an expression in the page."""
        found = self.call("Runtime.evaluate", expression=script, returnByValue=True)
        if "exceptionDetails" in found:
            raise RuntimeError(f"{script}: {found['exceptionDetails']}")
        return found["result"].get("value")

    def wait_for(self, script: str) -> Any:
        """Value of an expression, as soon as it is a true one."""
        end = time.monotonic() + PATIENCE_S
        while time.monotonic() < end:
            value = self.evaluate(script)
            if value:
                return value
            time.sleep(0.1)
        pytest.fail(f"the page did not come to: {script}; trouble: {self.trouble}")

    def processor_s(self) -> float:
        """Time of processors that pages have taken, their workers and drawing included, s."""
        processes = self.call("SystemInfo.getProcessInfo", session=None)["processInfo"]
        return sum(float(p["cpuTime"]) for p in processes if p["type"] == "renderer")

    def screenshot(self, path: Path, *, whole: bool = False) -> None:
        """Write a picture of the page, PNG."""
        taken = self.call("Page.captureScreenshot", captureBeyondViewport=whole)
        path.write_bytes(base64.b64decode(taken["data"]))

    def _read(self) -> dict[str, Any]:
        while b"\0" not in self._waiting:
            part = os.read(self._from, 1 << 16)
            if not part:
                raise RuntimeError("the browser has gone")
            self._waiting += part
        line, _, self._waiting = self._waiting.partition(b"\0")
        message: dict[str, Any] = json.loads(line)
        method, params = message.get("method"), message.get("params", {})
        self._loaded = self._loaded or method == "Page.loadEventFired"
        if method == "Network.requestWillBeSent":
            self.requests.append(params["request"]["url"])
        if method == "Runtime.exceptionThrown":
            self.trouble.append(str(params["exceptionDetails"]))
        if method == "Runtime.consoleAPICalled":
            self.trouble.append(str(params["args"]))
        if method == "Log.entryAdded":
            self.trouble.append(params["entry"]["text"])
        return message
