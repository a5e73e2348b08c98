"""A visit in Firefox and one in WebKit: Playwright needs builds of its own, so WebDriver drives the system's."""

import json
import os
import shutil
import socket
import subprocess
from collections.abc import Iterator
from itertools import count
from pathlib import Path
from typing import Any

import httpx
import pytest
from websockets.sync.client import connect
from websockets.sync.connection import Connection

from tests.browser.host import Server, until
from tests.browser.test_flat import OCCLUDER
from tests.browser.views import BALL, PARTICLES
from tests.waiting import wait_for

FIREFOX = shutil.which("firefox-esr") or shutil.which("firefox")
WEBKIT, DISPLAY = shutil.which("WebKitWebDriver"), shutil.which("Xvfb")
RIGHT = "\ue014"
SLIDER = "document.querySelector('.controls [type=range][aria-label^=Occluder]')"
BOX = f"{SLIDER}.parentElement.querySelector('[type=number]')"
FRAME = "Number(document.querySelector('.flat-canvas').dataset.frame)"
SCENE = "document.querySelector('.view-switch button:last-of-type')"


KEYS = {"type": "key", "id": "keys", "actions": [{"type": kind, "value": RIGHT} for kind in ("keyDown", "keyUp")]}


class Firefox:
    """A page that BiDi drives, and the errors of its console."""

    def __init__(self, socket: Connection) -> None:
        self._socket, self._numbers = socket, count()
        self.complaints: list[str] = []
        self._ask("session.new", capabilities={})
        self._page = self._ask("browsingContext.getTree")["contexts"][0]["context"]
        self._ask("session.subscribe", events=["log.entryAdded"])

    def _ask(self, method: str, **params: object) -> Any:
        """Send a command and return its result; errors of the console until then are kept."""
        number = next(self._numbers)
        self._socket.send(json.dumps({"id": number, "method": method, "params": params}))
        while (answer := json.loads(self._socket.recv(60))).get("id") != number:
            if answer["params"].get("level") == "error":
                self.complaints.append(answer["params"]["text"])
        assert answer["type"] == "success", answer
        return answer["result"]

    def visit(self, address: str) -> None:
        self._ask("browsingContext.navigate", context=self._page, url=address, wait="complete")

    def evaluate(self, expression: str) -> Any:
        target = {"context": self._page}
        done = self._ask("script.evaluate", expression=expression, target=target, awaitPromise=True)
        assert done["type"] == "success", done
        return done["result"].get("value")

    def press_right(self) -> None:
        self._ask("input.performActions", context=self._page, actions=[KEYS])


@pytest.fixture
def firefox(tmp_path: Path) -> Iterator[Firefox]:
    if FIREFOX is None:
        pytest.skip("needs Firefox, such as Debian's firefox-esr")
    command = [FIREFOX, "--headless", "--no-remote", "--remote-debugging-port=0", "--profile", str(tmp_path)]
    where = tmp_path / "WebDriverBiDiServer.json"
    with subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL) as process:
        try:
            said = wait_for(lambda: where.read_text() if where.exists() else "", what="Firefox listens")
            with connect(f"ws://127.0.0.1:{json.loads(said)['ws_port']}/session", max_size=None) as socket:
                yield Firefox(socket)
        finally:
            process.terminate()


class WebKit:
    """A page that WebDriver drives, and the errors of its scripts."""

    def __init__(self, driver: httpx.Client) -> None:
        self._driver = driver
        self._session = f"/session/{self._ask('/session', capabilities={})['sessionId']}"

    def _ask(self, path: str, **body: object) -> Any:
        answer = self._driver.post(path, json=body)
        assert answer.is_success, answer.text
        return answer.json()["value"]

    @property
    def complaints(self) -> list[str]:
        return list(self.evaluate("window.complaints"))

    def visit(self, address: str) -> None:
        self._ask(f"{self._session}/url", url=address)
        self.evaluate("addEventListener('error', ({ message }) => complaints.push(message), window.complaints = [])")

    def evaluate(self, expression: str) -> Any:
        return self._ask(f"{self._session}/execute/sync", script=f"return {expression}", args=[])

    def press_right(self) -> None:
        self._ask(f"{self._session}/actions", actions=[KEYS])

    def quit(self) -> None:
        self._driver.delete(self._session)


@pytest.fixture
def webkit() -> Iterator[WebKit]:
    if WEBKIT is None or DISPLAY is None:
        pytest.skip("needs Debian's webkit2gtk-driver and xvfb")
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    with subprocess.Popen([DISPLAY, "-displayfd", "1"], stdout=subprocess.PIPE, stderr=subprocess.DEVNULL) as display:
        number = display.stdout.readline().decode().strip()
        # With a locale of C the browser's language is none, which viser's page refuses.
        shown = {**os.environ, "DISPLAY": f":{number}", "GDK_BACKEND": "x11", "LC_ALL": "en_US.UTF-8"}
        with subprocess.Popen([WEBKIT, f"--port={port}"], env=shown) as process:
            try:
                with httpx.Client(base_url=f"http://127.0.0.1:{port}", timeout=60) as driver:
                    until(lambda: driver.get("/status").is_success, "the driver answers")
                    page = WebKit(driver)
                    yield page
                    page.quit()
            finally:
                process.terminate()
                display.terminate()


@pytest.mark.parametrize("engine", ["firefox", "webkit"])
def test_a_visit(engine: str, server: Server, request: pytest.FixtureRequest) -> None:
    """The ball is shown flat, a slider changes it, the 3-D view shows it or says why not; no script fails."""
    page = request.getfixturevalue(engine)

    def holds(expression: str, what: str) -> None:
        wait_for(lambda: page.evaluate(expression), 60.0, what)

    page.visit(f"{server.url}/{server.start_session()['page']}?view=flat")
    holds(f"{OCCLUDER} >= 38", "the picture is painted, with its occluder")
    page.evaluate(f"{SLIDER}.focus()")
    for _ in range(10):
        page.press_right()
    holds(f"{BOX}.value === '50'", "the box has followed the slider")
    page.evaluate("document.querySelector('.play').click()")
    holds(f"{FRAME} > 5 && {OCCLUDER} >= 48", "the run plays with the wider occluder")
    has_graphics = page.evaluate("document.createElement('canvas').getContext('webgl2') !== null")
    page.evaluate(f"{SCENE}.click()")
    shown = f"{BALL} && {PARTICLES} > 0".replace("window.", "document.querySelector('.scene iframe')?.contentWindow.")
    said = f"{SCENE}.disabled && {SCENE}.title.includes('no 3-D graphics')"
    holds(shown if has_graphics else said, "the scene has the ball and the cloud, or says that it cannot be drawn")
    server.end_sessions()
    assert page.complaints == []
