"""One visit in Firefox: Playwright needs a build of its own, so that of the system is driven by WebDriver BiDi."""

import json
import shutil
import subprocess
from collections.abc import Iterator
from itertools import count
from pathlib import Path
from typing import Any

import pytest
from websockets.sync.client import connect
from websockets.sync.connection import Connection

from tests.browser.host import Server
from tests.browser.test_flat import OCCLUDER
from tests.browser.views import BALL
from tests.waiting import wait_for

FIREFOX = shutil.which("firefox-esr") or shutil.which("firefox")
RIGHT = "\ue014"
SLIDER = "document.querySelector('.controls [type=range][aria-label^=Occluder]')"
BOX = f"{SLIDER}.parentElement.querySelector('[type=number]')"
FRAME = "Number(document.querySelector('.flat-canvas').dataset.frame)"
SCENE = "document.querySelector('.view-switch button:last-of-type')"


class Firefox:
    """A page, and what its console said."""

    def __init__(self, socket: Connection) -> None:
        self._socket, self._numbers = socket, count()
        self.complaints: list[str] = []
        self._ask("session.new", capabilities={})
        self._page = self._ask("browsingContext.getTree")["contexts"][0]["context"]
        self._ask("session.subscribe", events=["log.entryAdded"])

    def _ask(self, method: str, **params: object) -> Any:
        """Send a command and return its result; what the console says meanwhile is kept."""
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
        """Return a string, a number or a truth value."""
        target = {"context": self._page}
        done = self._ask("script.evaluate", expression=expression, target=target, awaitPromise=True)
        assert done["type"] == "success", done
        return done["result"].get("value")

    def press(self, key: str) -> None:
        keys = [{"type": kind, "value": key} for kind in ("keyDown", "keyUp")]
        self._ask("input.performActions", context=self._page, actions=[{"type": "key", "id": "keys", "actions": keys}])

    def until(self, expression: str, what: str) -> None:
        wait_for(lambda: self.evaluate(expression), 60.0, what)


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


def test_a_visit_in_firefox(firefox: Firefox, server: Server) -> None:
    """The ball is shown flat, a slider changes it, the 3-D view shows it or says why not; the console stays clean."""
    firefox.visit(f"{server.url}/{server.start_session()['page']}?view=flat")
    firefox.until(f"{OCCLUDER} >= 38", "the picture is painted, with its occluder")
    firefox.evaluate(f"{SLIDER}.focus()")
    for _ in range(10):
        firefox.press(RIGHT)
    firefox.until(f"{BOX}.value === '50'", "the box has followed the slider")
    firefox.evaluate("document.querySelector('.play').click()")
    firefox.until(f"{FRAME} > 5 && {OCCLUDER} >= 48", "the run plays with the wider occluder")
    has_graphics = firefox.evaluate("document.createElement('canvas').getContext('webgl2') !== null")
    firefox.evaluate(f"{SCENE}.click()")
    shown = f"document.querySelector('.scene iframe')?.contentWindow.eval({json.dumps(BALL)})"
    said = f"{SCENE}.disabled && {SCENE}.title.includes('no 3-D graphics')"
    firefox.until(shown if has_graphics else said, "the scene has the ball, or says that it cannot be drawn")
    server.end_sessions()
    assert firefox.complaints == []
