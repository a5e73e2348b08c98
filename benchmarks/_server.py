"""A real server in a process of its own, and its visitors' messages: shared by the benchmarks of sessions."""

import contextlib
import json
import os
import shutil
import struct
import subprocess
import sys
import tempfile
import time
import urllib.parse
import urllib.request
from collections.abc import Iterator
from typing import Any

import msgspec
import psutil
import viser
import zstandard
from _table import progress
from websockets.typing import Subprotocol

__all__ = [
    "CAMERA",
    "PROTOCOL",
    "SEEN",
    "Server",
    "chromium",
    "echoes",
    "memory_mib",
    "new_server",
    "percentile",
    "row",
    "scene_of",
    "unpack",
    "until",
]

PROTOCOL = Subprotocol(f"viser-v{viser.__version__}")
LONG = 18_000
FLAGS = ["--no-sandbox", "--enable-unsafe-swiftshader", "--disable-background-networking"]

# The first message of viser's client; without it the server counts no watcher.
_CAMERA = {
    "type": "ViewerCameraMessage",
    "wxyz": (1.0, 0.0, 0.0, 0.0),
    "position": (0.0, 0.0, 1.0),
    "fov": 0.8,
    "near": 0.1,
    "far": 1e4,
    "image_height": 600,
    "image_width": 800,
    "look_at": (0.0, 0.0, 0.0),
    "up_direction": (0.0, 1.0, 0.0),
}

CAMERA = msgspec.msgpack.encode(_CAMERA)

SEEN = """() => {
    let seen = false;
    window.__viserMutable?.nodeRefFromName['/picture']?.traverse((item) => {
        seen ||= Boolean(item.isMesh && item.material.map?.image);
    });
    return seen;
}"""


class Server:
    """A server in a process of its own, and the requests that the benchmarks make."""

    def __init__(self, folder: str, *, command: list[str] | None = None, **options: Any) -> None:
        """Start a server on a data folder, or by a command and options of `Popen`, and wait for its link."""
        command = command or [sys.executable, "-m", "pftrack", "serve", "--port", "0", "--data-dir", folder]
        options = {"env": os.environ | {"PFTRACK_BASE_PATH": ""}, **options}
        self.process = subprocess.Popen(
            command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True, **options
        )
        line = next((line for line in self.process.stdout or () if "http://" in line), None)
        if line is None:
            raise SystemExit("the server did not start")
        self.url = line[line.index("http://") :].strip().rstrip("/")
        self._origin = urllib.parse.urljoin(self.url, "/").rstrip("/")

    def ask(self, method: str, path: str, body: object = None) -> Any:
        """Make a request and return its JSON."""
        data = None if body is None else json.dumps(body).encode()
        headers = {"Content-Type": "application/json", "Origin": self._origin}
        request = urllib.request.Request(f"{self.url}{path}", data, headers, method=method)  # noqa: S310 - our own server
        with urllib.request.urlopen(request, timeout=60) as answer:  # noqa: S310
            content = answer.read()
            wanted = content and answer.headers.get_content_type() == "application/json"
            return json.loads(content) if wanted else content

    def start(self, *, play: bool, **parameters: object) -> str:
        """Start a long ball session with these parameters and return its name."""
        recipe = {"experiment": "ball", "frames": LONG, "timeline": [{"frame": 0, "values": parameters}]}
        session = str(self.ask("POST", "/api/v1/sessions", {"recipe": recipe})["id"])
        if play:
            self.ask("POST", f"/api/v1/sessions/{session}/commands", {"kind": "play"})
        return session

    def end(self, session: str) -> None:
        """End a session."""
        self.ask("DELETE", f"/api/v1/sessions/{session}")

    def family(self) -> list[psutil.Process]:
        """Return the web process and all its descendants."""
        web = psutil.Process(self.process.pid)
        return [web, *web.children(recursive=True)]

    def close(self) -> None:
        """End the server."""
        self.process.terminate()
        self.process.wait(timeout=30)


@contextlib.contextmanager
def new_server() -> Iterator[Server]:
    """Start a server without data, and end it."""
    with tempfile.TemporaryDirectory() as folder, contextlib.closing(Server(folder)) as server:
        yield server


@contextlib.contextmanager
def chromium() -> Iterator[Any]:
    """Open a browser; yield None if none is installed."""
    place = shutil.which("chromium") or shutil.which("chromium-headless-shell")
    try:
        from playwright.sync_api import sync_playwright
    except ImportError:
        place = None
    if place is None:
        progress("no chromium or no playwright: nothing is measured in a browser")
        yield None
        return
    with sync_playwright() as driver:
        browser = driver.chromium.launch(executable_path=place, args=FLAGS)
        yield browser
        browser.close()


def memory_mib(processes: list[psutil.Process]) -> float:
    """Return the memory of processes, MiB, with shared pages counted once."""
    return sum(process.memory_full_info().pss for process in processes) / 2**20


def until(frame: Any, expression: str, seconds: float = 60.0) -> None:
    """Poll a page until an expression is true; its policy forbids Playwright's own way of waiting."""
    end = time.perf_counter() + seconds
    while not frame.evaluate(expression):
        if time.perf_counter() > end:
            raise TimeoutError(expression)
        time.sleep(0.005)


def scene_of(page: Any) -> Any:
    """Wait for the frame of the scene and return it."""
    while (frame := page.frame(url="**/viz/**")) is None:
        page.wait_for_timeout(5)
    return frame


def unpack(message: bytes) -> bytes:
    """Undo viser's framing: two sizes, compressed msgpack, arrays."""
    plain, packed = struct.unpack_from("<QQ", message)
    return zstandard.ZstdDecompressor().decompress(message[16 : 16 + packed], max_output_size=plain)


def echoes(inner: bytes) -> list[bytes]:
    """Return answers to the scene's questions that measure a browser's delay."""
    if b"LocalStorageGetItemRequestMessage" not in inner:
        return []
    answer = {"type": "LocalStorageGetItemResponseMessage", "value": None, "error": None}
    asked = [
        it for it in msgspec.msgpack.decode(inner)["messages"] if it["type"] == "LocalStorageGetItemRequestMessage"
    ]
    return [msgspec.msgpack.encode(answer | {"request_uuid": it["request_uuid"]}) for it in asked]


def percentile(values: list[float], share: float) -> float:
    """Return a percentile."""
    return sorted(values)[min(len(values) - 1, int(share * len(values)))]


def row(what: str, typical: float | None, worst: float | None, goal: float | None = None) -> dict[str, object]:
    """Build a row; `of goal` is the worst figure as a share of the goal."""
    judged = typical if worst is None else worst
    share = judged / goal if goal and judged is not None else None
    return {"what": what, "median": typical, "p95 or worst": worst, "goal": goal, "of goal": share}
