"""A page in headless Chromium without network, driven through its DevTools port."""

import asyncio
import io
import json
import shutil
import subprocess
import tempfile
import time
from base64 import b64decode
from pathlib import Path
from types import TracebackType
from typing import Any, Self
from urllib.request import urlopen

import numpy as np
import pytest
from PIL import Image

CHROMIUM = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)
needs_browser = pytest.mark.skipif(CHROMIUM is None, reason="needs Chromium (on Debian the package chromium)")
FLAGS = (
    "--headless=new", "--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader",
    "--remote-debugging-port=0", "--host-resolver-rules=MAP * ~NOTFOUND, EXCLUDE 127.0.0.1",
)  # fmt: skip


class Browser:
    """One page; `events` are those that Chromium told of until the last call."""

    def __init__(self, width: int, height: int) -> None:
        self.width, self.height = width, height
        self.events: list[dict[str, Any]] = []
        self._calls = 0

    def __enter__(self) -> Self:
        from tornado.websocket import websocket_connect

        self._folder = tempfile.mkdtemp()
        command = [str(CHROMIUM), *FLAGS, f"--user-data-dir={self._folder}", "about:blank"]
        self._process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        told = Path(self._folder) / "DevToolsActivePort"
        self.wait(lambda: told.exists() and len(told.read_text().splitlines()) == 2)
        port = told.read_text().split()[0]
        with urlopen(f"http://127.0.0.1:{port}/json") as answer:
            page = next(each for each in json.load(answer) if each["type"] == "page")

        async def connected() -> Any:
            return await websocket_connect(page["webSocketDebuggerUrl"], max_message_size=10**9)

        self._runner = asyncio.Runner()
        self._socket = self._runner.run(connected())
        for domain in ("Page", "Runtime", "Network", "Log"):
            self.call(f"{domain}.enable")
        self.resize(self.width, self.height)
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        async def closed() -> None:  # outside a loop, tornado makes another one, which nobody closes
            self._socket.close()

        self._runner.run(closed())
        self._process.kill()
        self._process.wait()
        self._runner.close()
        shutil.rmtree(self._folder, ignore_errors=True)

    def call(self, method: str, **parameters: Any) -> Any:
        """A command of the DevTools protocol and its answer."""
        self._calls += 1
        number = self._calls

        async def answered() -> Any:
            await self._socket.write_message(json.dumps({"id": number, "method": method, "params": parameters}))
            while True:
                message = json.loads(await asyncio.wait_for(self._socket.read_message(), 120))
                if message.get("id") == number:
                    assert "error" not in message, message
                    return message["result"]
                self.events.append(message)

        return self._runner.run(answered())

    def value(self, script: str) -> Any:
        """What an expression of JavaScript is in the page."""
        found = self.call("Runtime.evaluate", expression=script, awaitPromise=True, returnByValue=True)
        assert "exceptionDetails" not in found, found
        return found["result"].get("value")

    def open(self, path: Path, ready: str) -> None:
        """Open a file and wait until an expression is true."""
        self.call("Page.navigate", url=path.resolve().as_uri())
        self.wait(lambda: self.value(ready))

    def resize(self, width: int, height: int) -> None:
        """Another size of the window."""
        size = {"width": width, "height": height}
        self.call("Emulation.setDeviceMetricsOverride", **size, deviceScaleFactor=1, mobile=False)

    def pixels(self) -> np.ndarray:
        """(height, width, 3) of the window."""
        data = b64decode(self.call("Page.captureScreenshot", format="png")["data"])
        return np.asarray(Image.open(io.BytesIO(data)).convert("RGB"))

    @staticmethod
    def wait(ready: Any, seconds: float = 60.0) -> None:
        """Until something is true, or the test fails."""
        end = time.monotonic() + seconds
        while not ready():
            assert time.monotonic() < end, "the browser did not answer"
            time.sleep(0.05)
