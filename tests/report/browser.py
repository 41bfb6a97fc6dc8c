"""One headless Chromium for many pages, spoken to by the DevTools protocol over a pipe."""

import base64
import json
import os
import shutil
import subprocess
import sys

PROGRAM = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)
OPTIONS = (
    "--headless --no-sandbox --disable-gpu --disable-quic --no-first-run --disable-background-networking "
    "--disable-component-update --disable-sync --hide-scrollbars --remote-debugging-pipe"
).split()
_PLUG = "import os, sys; a = sys.argv; [os.dup2(int(fd), k) for k, fd in enumerate(a[1:3], 3)]; os.execv(a[3], a[3:])"
"""The browser reads from the descriptor 3 and writes to 4, which Python may use for something else."""


class Browser:
    """A browser with one tab; ``complaints`` are what the console says of the page that was opened last."""

    def __init__(self, profile):
        (reads, self._to), (self._answers, writes) = os.pipe(), os.pipe()
        pair = [str(fd) for fd in (reads, writes)]
        command = [sys.executable, "-c", _PLUG, *pair, PROGRAM, *OPTIONS, f"--user-data-dir={profile}", "about:blank"]
        quiet = {
            "stdout": subprocess.DEVNULL,
            "stderr": subprocess.DEVNULL,
            "env": {**os.environ, "HOME": str(profile)},
        }
        self._process = subprocess.Popen(command, pass_fds=(reads, writes), **quiet)
        for fd in (reads, writes):
            os.close(fd)
        self._heard, self._calls, self._events, self._session = b"", 0, [], None
        target = self.call("Target.createTarget", url="about:blank")["targetId"]
        self._session = self.call("Target.attachToTarget", targetId=target, flatten=True)["sessionId"]
        for domain in ("Page", "Runtime", "Log", "Network"):
            self.call(f"{domain}.enable")

    def call(self, method, **params):
        """Answer to a command of the protocol."""
        self._calls += 1
        said = {"id": self._calls, "method": method, "params": params}
        said |= {"sessionId": self._session} if self._session else {}
        os.write(self._to, json.dumps(said).encode() + b"\0")
        while True:
            told = self._next()
            if told.get("id") == self._calls:
                assert "error" not in told, told
                return told["result"]
            self._events.append(told)

    def _next(self):
        while b"\0" not in self._heard:
            piece = os.read(self._answers, 1 << 20)
            assert piece, "the browser has gone"
            self._heard += piece
        one, _, self._heard = self._heard.partition(b"\0")
        return json.loads(one)

    def open(self, file, width, height=900):
        """Open a file in a window of some width, a telephone's below 600 pixels."""
        small = width < 600
        self.call("Emulation.setEmulatedMedia", media="")
        self.call("Emulation.setDeviceMetricsOverride", width=width, height=height, deviceScaleFactor=1, mobile=small)
        self._events.clear()
        self.call("Page.navigate", url=file.as_uri())
        while not any(event.get("method") == "Page.loadEventFired" for event in self._events):
            self._events.append(self._next())

    @property
    def complaints(self):
        """Errors and warnings of the console, exceptions, and what could not be fetched."""
        found = []
        for event in self._events:
            kind, told = event.get("method"), event.get("params", {})
            if kind == "Runtime.exceptionThrown" or (
                kind == "Runtime.consoleAPICalled" and told["type"] in ("error", "warning", "assert")
            ):
                found.append(json.dumps(told)[:300])
            elif kind == "Log.entryAdded" and told["entry"]["level"] in ("error", "warning"):
                found.append(told["entry"]["text"])
        return found

    @property
    def fetched(self):
        """Addresses that the page was made of, but for what stands in it."""
        asked = [e["params"]["request"]["url"] for e in self._events if e.get("method") == "Network.requestWillBeSent"]
        return {address for address in asked if not address.startswith("data:")}

    def value(self, script):
        """Value of an expression in the page, as JSON can hold it."""
        told = self.call("Runtime.evaluate", expression=script, returnByValue=True, awaitPromise=True)
        assert "exceptionDetails" not in told, told["exceptionDetails"]
        return told["result"].get("value")

    def pdf(self):
        """The page as it is printed, on the paper that its style asks for."""
        return base64.b64decode(self.call("Page.printToPDF", printBackground=True, preferCSSPageSize=True)["data"])

    def picture(self):
        """The whole page as PNG."""
        return base64.b64decode(self.call("Page.captureScreenshot", captureBeyondViewport=True)["data"])

    def close(self):
        """End the browser."""
        self.call("Browser.close")
        self._process.wait(30)
        for fd in (self._to, self._answers):
            os.close(fd)
