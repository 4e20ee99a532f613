"""A headless Chromium, driven through its debugging pipe: pages at a stated width, scheme and medium."""

from __future__ import annotations

import base64
import itertools
import json
import os
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

CHROMIUM = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)
# The browser reads descriptor 3 and writes descriptor 4.
_START = ("import fcntl, os, sys; "
          "ends = [fcntl.fcntl(int(end), fcntl.F_DUPFD, 10) for end in sys.argv[1:3]]; "
          "[os.dup2(end, 3 + k) for k, end in enumerate(ends)]; os.execv(sys.argv[3], sys.argv[3:])")
_TALLEST = 16_000  # px of a picture: what the browser can draw at once


class Page:
    """The one tab of a browser.

    Parameters
    ----------
    ask, answers : int
        File descriptors of its debugging pipe: to write to, and to read from.
    """

    def __init__(self, ask: int, answers: int) -> None:
        self._ask, self._answers = os.fdopen(ask, "wb", buffering=0), os.fdopen(answers, "rb", buffering=0)
        self._numbers, self._rest, self._session = itertools.count(1), b"", ""
        self.console: list[str] = []
        target = self._call("Target.createTarget", url="about:blank")["targetId"]
        self._session = self._call("Target.attachToTarget", targetId=target, flatten=True)["sessionId"]
        for domain in ("Page", "Runtime", "Log", "Network"):
            self._call(f"{domain}.enable")

    def show(self, path: Path, *, width: int = 1280, height: int = 900, dark: bool = False, medium: str = "screen"
             ) -> None:
        """Load a file; `console` then holds what the page complained of."""
        self.console.clear()
        self._call("Emulation.setDeviceMetricsOverride", width=width, height=height, deviceScaleFactor=1,
                   mobile=width < 600)
        self._call("Emulation.setEmulatedMedia", media=medium, features=[
            {"name": "prefers-color-scheme", "value": "dark" if dark else "light"}])
        self._call("Page.navigate", url=path.resolve().as_uri())
        self._wait("Page.loadEventFired")

    def evaluate(self, script: str) -> Any:
        """Value of an expression in the page; of a promise, what it resolves to."""
        done = self._call("Runtime.evaluate", expression=script, awaitPromise=True, returnByValue=True)
        assert "exceptionDetails" not in done, done["exceptionDetails"]
        return done["result"].get("value")

    def picture(self, *, height: int | None = None) -> bytes:
        """PNG of the page as it is shown: from its top, of that many pixels, or of all of it."""
        size = self._call("Page.getLayoutMetrics")["cssContentSize"]
        clip = {"x": 0, "y": 0, "width": size["width"], "height": min(height or size["height"], _TALLEST), "scale": 1}
        shot = self._call("Page.captureScreenshot", format="png", clip=clip, captureBeyondViewport=True)
        return base64.b64decode(shot["data"])

    def printed(self) -> bytes:
        """PDF of the page, in the size of paper that it asks for."""
        return base64.b64decode(self._call("Page.printToPDF", preferCSSPageSize=True, printBackground=False)["data"])

    def _call(self, method: str, **arguments: Any) -> dict[str, Any]:
        number = next(self._numbers)
        message = {"id": number, "method": method, "params": arguments}
        if self._session:
            message["sessionId"] = self._session
        self._ask.write(json.dumps(message).encode() + b"\0")
        while (answer := self._next()).get("id") != number:
            pass
        assert "error" not in answer, answer["error"]
        return dict(answer["result"])

    def _wait(self, event: str) -> None:
        while self._next().get("method") != event:
            pass

    def _next(self) -> dict[str, Any]:
        while b"\0" not in self._rest:
            read = os.read(self._answers.fileno(), 1 << 16)
            assert read, "the browser has ended"
            self._rest += read
        text, _, self._rest = self._rest.partition(b"\0")
        message: dict[str, Any] = json.loads(text)
        said = message.get("params", {})
        if message.get("method") == "Runtime.exceptionThrown":
            self.console.append(said["exceptionDetails"]["text"])
        elif message.get("method") == "Log.entryAdded":
            self.console.append(said["entry"]["text"])
        elif message.get("method") == "Runtime.consoleAPICalled":
            self.console.append(" ".join(str(one.get("value", one)) for one in said["args"]))
        return message


@contextmanager
def browser() -> Iterator[Page]:
    """A tab of a browser of its own, without a network; it ends with the block."""
    assert CHROMIUM is not None
    # No sandbox: test machines are often containers, and the pages are our own. No network: a page must not want any.
    options = ["--headless", "--no-sandbox", "--disable-gpu", "--disable-dev-shm-usage", "--hide-scrollbars",
               "--proxy-server=127.0.0.1:9", "--remote-debugging-pipe", "--allow-file-access-from-files"]
    asked, ask = os.pipe()
    answers, answer = os.pipe()
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as profile:
        words = [sys.executable, "-c", _START, str(asked), str(answer), CHROMIUM, *options]
        process = subprocess.Popen([*words, f"--user-data-dir={profile}"], pass_fds=(asked, answer),
                                   stderr=subprocess.DEVNULL, stdout=subprocess.DEVNULL)
        os.close(asked)
        os.close(answer)
        try:
            yield Page(ask, answers)
        finally:
            process.terminate()
            process.wait(timeout=30)
