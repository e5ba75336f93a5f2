"""A real browser for the tests of pages: Chromium without a window, driven through the DevTools protocol over pipes."""

from __future__ import annotations

import base64
import fcntl
import json
import os
import re
import select
import shutil
import subprocess
import time
from base64 import b64encode
from hashlib import sha256
from html.parser import HTMLParser
from pathlib import Path

import pytest

NAMES = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable")
PATIENCE = 60.0  # seconds, for a loaded machine
FLAGS = (
    "--headless=new", "--no-sandbox", "--disable-dev-shm-usage", "--hide-scrollbars", "--no-first-run",
    "--enable-unsafe-swiftshader", "--use-angle=swiftshader", "--disable-background-networking",
)


VOID = {"meta", "link", "input", "img", "br"}
COUNT = """((name) => {
  const canvas = document.getElementById(name);
  const copy = new OffscreenCanvas(canvas.width, canvas.height).getContext("2d");
  copy.drawImage(canvas, 0, 0);
  const { data } = copy.getImageData(0, 0, canvas.width, canvas.height);
  const found = { all: 0, orange: 0, blue: 0, green: 0, black: 0, sum: 0 };
  for (let k = 0; k < data.length; k += 4) {
    if (data[k + 3] < 200) continue;
    const [r, g, b] = data.subarray(k, k + 3);
    found.all++;
    found.sum = (found.sum * 31 + r + 7 * g + 13 * b + k) % 1000003;
    if (r > g + 40 && g > b + 20) found.orange++;
    if (b > r + 60 && b > g + 25) found.blue++;
    if (g > r + 60 && g > b + 20) found.green++;
    if (r + g + b < 90) found.black++;
  }
  return found;
})"""


class Reader(HTMLParser):
    """What a page holds, as a browser would read it: elements with their attributes, and the text of some."""

    def __init__(self, text: str) -> None:
        super().__init__(convert_charrefs=True)
        self.elements, self.texts, self._open = [], {}, []
        self.feed(text)
        self.close()
        assert not self._open, f"never closed: {self._open}"

    def handle_starttag(self, tag, attrs):
        self.elements.append((tag, dict(attrs)))
        if tag not in VOID:
            self._open.append(tag)
            self.texts.setdefault(tag, []).append("")

    def handle_startendtag(self, tag, attrs):
        self.elements.append((tag, dict(attrs)))

    def handle_endtag(self, tag):
        assert self._open.pop() == tag

    def handle_data(self, data):
        if self._open:
            self.texts[self._open[-1]][-1] += data

    def values(self, attribute):
        return [attrs[attribute] for _, attrs in self.elements if attribute in attrs]


class Chromium:
    """One page of a browser. complaints: what it wrote to the console as errors or warnings, and what it threw."""

    def __init__(self, program: str, profile: Path) -> None:
        there, self._to = os.pipe()
        self._from, back = os.pipe()
        there, back = (fcntl.fcntl(end, fcntl.F_DUPFD, 10) for end in (there, back))  # away from 3 and 4

        def as_the_protocol_has_it() -> None:
            os.dup2(there, 3)
            os.dup2(back, 4)

        self._process = subprocess.Popen(
            [program, *FLAGS, "--remote-debugging-pipe", f"--user-data-dir={profile}", "about:blank"],
            pass_fds=(3, 4), preexec_fn=as_the_protocol_has_it, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
        )
        os.close(there)
        os.close(back)
        self._read, self._number, self._session = b"", 0, None
        self.complaints: list[str] = []
        (page,) = [t for t in self.call("Target.getTargets")["targetInfos"] if t["type"] == "page"]
        self._session = self.call("Target.attachToTarget", targetId=page["targetId"], flatten=True)["sessionId"]
        for domain in ("Page", "Runtime", "Log"):
            self.call(f"{domain}.enable")

    def call(self, method: str, **params):
        """Calls a method of the protocol; its result."""
        self._number += 1
        message = {"id": self._number, "method": method, "params": params}
        if self._session is not None:
            message["sessionId"] = self._session
        os.write(self._to, json.dumps(message).encode() + b"\0")
        end = time.monotonic() + PATIENCE
        while True:
            answer = self._next(end)
            if answer.get("id") == self._number:
                assert "error" not in answer, answer
                return answer["result"]

    def open(self, path: Path, width: int = 1200, height: int = 900, dark: bool = False) -> float:
        """Loads a page from a file and waits for its first picture; returns the seconds that took."""
        self.complaints.clear()
        size = {"width": width, "height": height, "deviceScaleFactor": 1, "mobile": width < 600}
        self.call("Emulation.setDeviceMetricsOverride", **size)
        scheme = [{"name": "prefers-color-scheme", "value": "dark" if dark else "light"}]
        self.call("Emulation.setEmulatedMedia", features=scheme)
        begun = time.monotonic()
        self.call("Page.navigate", url=path.absolute().as_uri())
        self.wait_for("document.readyState === 'complete' && location.protocol === 'file:'")
        self.settle()
        return time.monotonic() - begun

    def run(self, script: str):
        """What a JavaScript expression gives, promises awaited."""
        done = self.call("Runtime.evaluate", expression=script, returnByValue=True, awaitPromise=True)
        assert "exceptionDetails" not in done, done["exceptionDetails"]
        return done["result"].get("value")

    def settle(self) -> None:
        """Waits until what was asked for is drawn."""
        self.run("new Promise(done => requestAnimationFrame(() => requestAnimationFrame(() => done(1))))")

    def wait_for(self, condition: str) -> None:
        end = time.monotonic() + PATIENCE
        while not self.run(condition):
            assert time.monotonic() < end, f"never came true: {condition}"
            time.sleep(0.05)

    def click(self, selector: str) -> None:
        """Presses and releases the mouse in the middle of an element, as a person does."""
        box = self.run(
            f"(() => {{ const e = document.querySelector({selector!r}); e.scrollIntoView({{block: 'center'}});"
            "const b = e.getBoundingClientRect(); return [b.x + b.width / 2, b.y + b.height / 2]; })()"
        )
        for kind in ("mousePressed", "mouseReleased"):
            self.call("Input.dispatchMouseEvent", type=kind, x=box[0], y=box[1], button="left", clickCount=1)
        self.settle()

    def press(self, key: str, code: str | None = None) -> None:
        """Presses a key on what has the focus."""
        text = {"text": key} if len(key) == 1 else {}
        codes = {"ArrowLeft": 37, "ArrowUp": 38, "ArrowRight": 39, "ArrowDown": 40, "Tab": 9, " ": 32}
        number = codes.get(key, ord(key.upper()) if len(key) == 1 else 0)
        for kind in ("keyDown", "keyUp"):
            self.call(
                "Input.dispatchKeyEvent", type=kind, key=key, code=code or key, windowsVirtualKeyCode=number,
                **(text if kind == "keyDown" else {}),
            )
        self.settle()

    def screenshot(self, path: Path, whole: bool = False) -> None:
        shot = self.call("Page.captureScreenshot", format="png", captureBeyondViewport=whole)
        path.write_bytes(base64.b64decode(shot["data"]))

    def close(self) -> None:
        self._session = None
        try:
            self.call("Browser.close")
        except (OSError, AssertionError):
            self._process.kill()
        self._process.wait(PATIENCE)
        os.close(self._to)
        os.close(self._from)

    def _next(self, end: float):
        while b"\0" not in self._read:
            ready = select.select([self._from], [], [], max(end - time.monotonic(), 0))[0]
            assert ready, "the browser does not answer"
            part = os.read(self._from, 2**20)
            assert part, "the browser has ended"
            self._read += part
        line, self._read = self._read.split(b"\0", 1)
        message = json.loads(line)
        self._hear(message)
        return message

    def _hear(self, message) -> None:
        params = message.get("params", {})
        if message.get("method") == "Runtime.exceptionThrown":
            self.complaints.append(str(params["exceptionDetails"]))
        if message.get("method") == "Runtime.consoleAPICalled" and params["type"] in ("error", "warning", "assert"):
            self.complaints.append(str(params["args"]))
        if message.get("method") == "Log.entryAdded" and params["entry"]["level"] in ("error", "warning"):
            self.complaints.append(params["entry"]["text"])


@pytest.fixture(scope="session")
def chromium(tmp_path_factory):
    """A browser, one for all tests; they skip where there is none."""
    program = next(filter(None, map(shutil.which, NAMES)), None)
    if program is None:
        pytest.skip(f"no browser: none of {', '.join(NAMES)} is installed")
    browser = Chromium(program, tmp_path_factory.mktemp("profile"))
    yield browser
    browser.close()


@pytest.fixture(scope="session")
def seen():
    """seen(browser, canvas): how many pixels of a canvas are drawn on, in which colours, and a sum that tells pictures
    apart."""

    def count(browser, canvas="canvas"):
        browser.settle()
        return browser.run(f"{COUNT}({canvas!r})")

    return count


@pytest.fixture(scope="session")
def reader():
    """The class Reader."""
    return Reader


@pytest.fixture(scope="session")
def data_of():
    """data_of(path): what the scripts of a page find."""

    def read(path):
        data = r'<script type="application/json" id="data">(.*?)</script>'
        return json.loads(re.search(data, path.read_text("utf-8"), re.DOTALL)[1])

    return read


@pytest.fixture(scope="session")
def sound():
    """sound(path): that a page is well formed, names what it refers to, has a name for every control and picture, and
    asks nothing of a network."""

    def check(path):
        text = path.read_text("utf-8")
        page = Reader(text)
        ids = page.values("id")
        assert len(ids) == len(set(ids))
        for attribute in ("for", "aria-controls", "aria-labelledby", "aria-describedby", "data-of"):
            assert set(page.values(attribute)) <= set(ids), attribute
        within = re.findall(r'<label[^>]*>[^<]*<(?:input|select)[^>]*id="([^"]+)"', text)
        labelled = {*page.values("for"), *within}
        for tag, attrs in page.elements:
            if tag in ("input", "select") and attrs.get("type") != "radio":
                assert attrs["id"] in labelled or "aria-label" in attrs
            if tag == "canvas" or (tag == "svg" and "aria-hidden" not in attrs):
                assert attrs["role"] == "img"
                assert attrs["aria-label"]
            assert not [name for name in attrs if name.startswith("on") or name in ("src", "style")]
        assert all(button.strip() for button in page.texts["button"])
        assert {link[0] for link in page.values("href") if link != "data:,"} == {"#"}
        policy = next(attrs["content"] for _, attrs in page.elements if "http-equiv" in attrs)
        assert policy.startswith("default-src 'none'; script-src 'sha256-")
        assert not re.search(r"unsafe|http|\*|strict-dynamic", policy)
        # It lets run and style, by hash, what is the page's own.
        programs = [attrs.get("type") is None for tag, attrs in page.elements if tag == "script"]
        live = [text for text, is_program in zip(page.texts["script"], programs, strict=True) if is_program]
        hashes = {b64encode(sha256(text.encode()).digest()).decode() for text in [*live, *page.texts["style"]]}
        assert set(re.findall(r"'sha256-([^']+)'", policy)) == hashes

    return check
