"""A watched session: a real viewer behind a real web server, and a browser that speaks its protocol."""

import asyncio
import contextlib
import threading
from collections.abc import Callable
from typing import Any, Self, TypeAlias
from urllib.parse import unquote

import msgspec
import numpy as np
import uvicorn
import viser
import zstandard
from fastapi import FastAPI, Response, WebSocket
from numpy.typing import NDArray
from websockets.sync.client import ClientConnection, connect
from websockets.typing import Subprotocol

from pftrack.core.model import drawing as model
from pftrack.core.model.drawing import COLOURS, Drawing, Layer, Picture, Points, Polyline, Primitive
from pftrack.core.model.parameters import Declaration, Value
from pftrack_server.core.panel import PanelDescription, PanelValues, TrackerPublic
from pftrack_server.core.pictures import PictureEncoder
from pftrack_server.viewer import CONTENT_SECURITY_POLICY, Viewer, bridge, client_asset, client_page
from tests.conftest import BASE
from tests.waiting import wait_for

Condition: TypeAlias = Callable[[], object]
AT_ONCE: Condition = object
"""Always holds."""

PROTOCOL = Subprotocol(f"viser-v{viser.__version__}")
LAYERS = (
    Layer("picture"),
    Layer("particles", legend=(model.Key("prediction", "particles"),)),
    Layer("trail", role="flat only"),
    Layer("history", shown=False, role="through time"),
    Layer("estimate", legend=(model.Key("estimate", "estimate"),)),
    Layer("labels", shown=False),
)
TRACKERS = {"condensation": "Condensation", "h-spf": "h-SPF"}


def f32(*rows: object) -> NDArray[np.float32]:
    return np.array(rows, dtype=np.float32)


def declare(name: str, title: str, kind: str, default: Value, **more: Any) -> Declaration:
    return Declaration.model_validate(
        {"name": name, "title": title, "kind": kind, "default": default, "description": f"{title}.", "unit": ""} | more
    )


def number(name: str, title: str, default: float, bounds: tuple[Any, Any, Any], **more: Any) -> Declaration:
    """Return the declaration of a number; bounds are minimum, maximum and the useful range."""
    kind = "integer" if isinstance(default, int) else "number"
    limits = dict(zip(("minimum", "maximum", "useful"), bounds, strict=True))
    return declare(name, title, kind, default, step=1, **limits, **more)


DECLARATIONS = (
    number("occlusion_width_px", "Occluder width", 40.0, (0, 200, (0, 200)), unit="px", group="Scene"),
    declare("layout", "Layout", "choice", "pillar", choices=("pillar", "wall"), group="Scene"),
    declare("colour", "Ball colour", "colour", "#d02020", group="Scene"),
    number("sample_count", "Particles", 800, (1, 100_000, (1, 5000)), group="Tracker"),
    declare("learn", "Learn", "boolean", default=False, group="Tracker", live=False),
    number("gamma_px", "Threshold", 12.0, (0, 100, (0, 100)), group="Switching", trackers=("h-spf",)),
    number("budget", "Budget", 10, (0, 10**9, None), group="Tracker"),
)
SAID: dict[str, dict[str, Any]] = {
    "GuiUpdateMessage": {"uuid": "a", "updates": {"value": 1}},
    "LocalStorageGetItemResponseMessage": {"request_uuid": "a", "value": None, "error": None},
    "SceneNodeDragMessage": {
        "phase": "end",
        "name": "/grips",
        "instance_index": 7,
        "start_position": [0.0, 0.0, 0.0],
        "start_screen_pos": [0.0, 0.0],
        "end_position": [0.0, 0.0, 0.0],
        "end_screen_pos": [0.0, 0.0],
        "button": "left",
        "modifier": "shift",
        "owner": "",
    },
    "ViewerCameraMessage": {
        "wxyz": [1.0, 0.0, 0.0, 0.0],
        "position": [0.0, 0.0, 0.0],
        "fov": 1.0,
        "near": 0.1,
        "far": 9.0,
        "image_height": 1,
        "image_width": 1,
        "look_at": [0.0, 0.0, 1.0],
        "up_direction": [0.0, 1.0, 0.0],
    },
}
"""Well-formed messages of browsers."""

VALUES: dict[str, Value] = {item.name: item.default for item in DECLARATIONS}


def drawing(frame: int = 0, count: int = 800) -> Drawing:
    """Return a drawing of 320 x 240 px with a red corner and a cloud that rises to 30 px."""
    picture = np.full((240, 320, 3), (200, 210, 195), dtype=np.uint8)
    picture[:60, :80] = (208, 32, 32)
    positions = np.random.default_rng(frame).normal((160.0, 120.0, 0.0), 12.0, (count, 3)).astype(np.float32)
    positions[:, 2] = np.linspace(0.0, 30.0, count)
    trail = f32(*([160.0 - 2 * k, 120.0, 1.5 * k] for k in range(40)))
    blue = COLOURS["estimate"]
    primitives: dict[str, Primitive] = {
        "picture": Picture(picture),
        "trail": Polyline(trail, blue, 1.5, "trail"),
        "particles": Points(positions, np.tile(np.uint8(COLOURS["prediction"]), (count, 1)), 2.0),
        "estimate": model.Ellipse(f32(160.0, 120.0, 0.0), f32((9, 0), (0, 6)), blue, 2.0, "estimate"),
        "label": model.Text(f32(2.0, 12.0, 0.0), "APF", blue, "labels"),
    }
    return Drawing(320, 240, primitives, f"Frame {frame}")


class Loop:
    """An event loop in a thread of its own."""

    def __init__(self) -> None:
        self.loop = asyncio.new_event_loop()
        self._thread = threading.Thread(target=self.loop.run_forever, daemon=True)
        self._thread.start()

    def call(self, function: Callable[..., Any], *arguments: Any, **more: Any) -> Any:
        """Call a function, or await a coroutine function, in the loop; return its result."""

        async def act() -> Any:
            result = function(*arguments, **more)
            return await result if asyncio.iscoroutine(result) else result

        return asyncio.run_coroutine_threadsafe(act(), self.loop).result(30)

    def close(self) -> None:
        self.loop.call_soon_threadsafe(self.loop.stop)
        self._thread.join(10)
        self.loop.close()


class Session:
    """Stands in for a session: it keeps the values, accepts or refuses changes, and records the commands."""

    def __init__(self, *, worlds: tuple[model.World, ...] = ()) -> None:
        self.changes: list[dict[str, Value]] = []
        self.transport: list[dict[str, Any]] = []
        self.values, self.tracker = dict(VALUES), "h-spf"
        self.accept: Callable[[dict[str, Value]], str | None] = lambda _: None
        self.pictures = PictureEncoder()
        self.loop = Loop()
        panel = PanelDescription(
            title="Ball behind an occluder",
            declarations=list(DECLARATIONS),
            trackers=[TrackerPublic(id=name, title=title) for name, title in TRACKERS.items()],
            layers=list(LAYERS),
            worlds=list(worlds),
        )
        self.viewer: Viewer = self.loop.call(Viewer, panel, self.in_force, on_command=self._obey)

    def disconnect(self) -> None:
        """Disconnect all browsers, which may connect again."""
        self.loop.call(lambda: [task.cancel() for task in self.viewer.endpoint._connections])

    def close(self) -> None:
        """End the viewer and its loop."""
        self.loop.call(self.viewer.close)
        self.loop.close()

    @property
    def in_force(self) -> PanelValues:
        return PanelValues(dict(self.values), self.tracker, seed=7)

    def show(self, drawing: Drawing, frame: int, until: Condition = AT_ONCE) -> None:
        """Show a drawing as a worker sends it, and wait for a condition."""
        self.loop.call(self.viewer.show, self.pictures.for_scene(drawing), frame)
        wait_for(until)

    def tell(self, in_force: PanelValues, until: Condition = AT_ONCE) -> None:
        """Show the current values in the panel, and wait for a condition."""
        self.loop.call(self.viewer.tell, in_force)
        wait_for(until)

    def reset(self) -> None:
        self.values, self.tracker, self.accept = dict(VALUES), "h-spf", lambda _: None
        self.changes.clear()
        self.tell(self.in_force)

    def _obey(self, command: dict[str, Any]) -> None:
        values = command.get("values")
        if values is None:
            self.transport.append(command)
            return
        if "tracker" in values:
            self.tracker = str(values["tracker"])
        else:
            self.changes.append(values)
            refusal = self.accept(values)
            if refusal is not None:
                self.viewer.refuse(refusal)
                return
            self.values |= values
        self.viewer.tell(self.in_force)


PAGE = """<!doctype html><style>body{margin:0}iframe{border:0;width:930px;height:560px}</style>
<iframe src="viz/one/?websocket=ws://192.0.2.1/"></iframe><input>
<script>window.heard = []; addEventListener("message", (event) => heard.push(event.data));</script>"""


class Site:
    """A web server in the loop of one session that serves its scene, and a page around it that listens."""

    def __init__(self, session: Session) -> None:
        self.bridges = 0
        self.looks_only = False
        app, base = FastAPI(), unquote(BASE)

        @app.get(f"{base}/")
        async def _() -> Response:
            return Response(PAGE, media_type="text/html")

        @app.get(f"{base}/viz/one/")
        async def _() -> Response:
            policy = {"Content-Security-Policy": CONTENT_SECURITY_POLICY}
            return Response(client_page(), media_type="text/html", headers=policy)

        @app.get(f"{base}/viz/client/{{name}}")
        async def _(name: str) -> Response:
            file: Any = client_asset(name)
            return Response(file.content, media_type=file.media_type)

        @app.websocket(f"{base}/viz/one")
        async def _(websocket: WebSocket) -> None:
            self.bridges += 1
            try:
                await bridge(websocket, session.viewer.endpoint, looks_only=self.looks_only)
            finally:
                self.bridges -= 1

        options: Any = {"log_level": "error", "lifespan": "off", "timeout_graceful_shutdown": 2}
        self._server = uvicorn.Server(uvicorn.Config(app, port=0, ws_per_message_deflate=False, **options))
        self._serving = asyncio.run_coroutine_threadsafe(self._server.serve(), session.loop.loop)
        wait_for(lambda: self._server.started)
        port = self._server.servers[0].sockets[0].getsockname()[1]
        self.url = f"http://127.0.0.1:{port}{BASE}"
        self.scene = f"ws://127.0.0.1:{port}{BASE}/viz/one"

    def close(self) -> None:
        self._server.should_exit = True
        self._serving.result(10)


class Websocket:
    """A browser's websocket, as Starlette has it, that takes messages with a delay, or not until `free` is set."""

    def __init__(self, *, takes: bool = True) -> None:
        self.taken: list[bytes] = []
        self.said: asyncio.Queue[dict[str, Any]] = asyncio.Queue()
        self.delay_s = 0.0
        self.begun, self.free = asyncio.Event(), asyncio.Event()
        if takes:
            self.free.set()

    async def send_bytes(self, message: bytes) -> None:
        await asyncio.sleep(self.delay_s)
        self.taken.append(message)
        self.begun.set()
        await self.free.wait()

    async def receive(self) -> dict[str, Any]:
        return await self.said.get()

    def say(self, kind: str, **fields: Any) -> None:
        """Send a message as a browser does."""
        data = msgspec.msgpack.encode({"type": kind, **fields})
        self.said.put_nowait({"type": "websocket.receive", "bytes": data})


class Peer:
    """A browser without a display: it speaks viser's protocol and keeps the newest state that it received."""

    def __init__(self, address: str, cookie: str = "") -> None:
        headers = {"cookie": cookie} if cookie else None
        self.socket: ClientConnection = connect(
            address, subprotocols=[PROTOCOL], compression=None, max_size=None, proxy=None, additional_headers=headers
        )
        self.controls: dict[str, dict[str, Any]] = {}
        self.nodes: dict[str, dict[str, Any]] = {}
        self.visible: dict[str, bool] = {}
        self.camera: dict[str, Any] = {}
        self.notes: list[str] = []
        self.echo = True
        self.asked = 0
        self._question = ""
        self.batches = 0
        self._thread = threading.Thread(target=self._listen, daemon=True)
        self._thread.start()
        self.look(wide=800, high=600)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        self.socket.close()
        self._thread.join(timeout=5)

    def send(self, kind: str, **fields: Any) -> None:
        self.socket.send(msgspec.msgpack.encode({"type": kind, **fields}))

    def look(self, wide: int, high: int, position: tuple[float, ...] = (3.0, 3.0, 3.0)) -> None:
        window = {"image_height": high, "image_width": wide, "position": list(position)}
        self.send("ViewerCameraMessage", **SAID["ViewerCameraMessage"] | window)

    def move(self, label: str, value: object, until: Condition = AT_ONCE) -> None:
        """Move a control, and wait for a condition."""
        self.send("GuiUpdateMessage", uuid=self.uuid(label), updates={"value": value})
        wait_for(until)

    def move_view(self, title: str, group: str = "View", until: Condition = AT_ONCE) -> None:
        self.move(group, title, until)

    def answer(self) -> None:
        """Answer the latest question."""
        self.send("LocalStorageGetItemResponseMessage", request_uuid=self._question, value=None, error=None)

    def _hear(self, question: str) -> None:
        self.asked += 1
        self._question = question
        if self.echo:
            self.answer()

    def uuid(self, label: str) -> str:
        wait_for(lambda: any(item["label"] == label for item in list(self.controls.values())))
        return next(uuid for uuid, item in list(self.controls.items()) if item["label"] == label)

    def control(self, label: str) -> dict[str, Any]:
        return self.controls[self.uuid(label)]

    def _listen(self) -> None:
        with contextlib.suppress(Exception):
            while True:
                messages = decode(self.socket.recv(decode=False))
                self.batches += 1
                for message in messages:
                    self._take(message)

    def _take(self, message: dict[str, Any]) -> None:
        kind = message["type"]
        props = message.get("props")
        if kind.startswith("Gui") and isinstance(props, dict) and "uuid" in message:
            self.controls[message["uuid"]] = {"label": None, "value": message.get("value"), "kind": kind, **props}
        elif kind == "GuiUpdateMessage":
            self.controls.get(message["uuid"], {}).update(message["updates"])
        elif kind == "NotificationShowMessage":
            self.notes.append(message["props"]["body"])
        elif kind in {"SceneNodeUpdateMessage", "SetPositionMessage"}:
            self.nodes.get(message["name"], {}).update(message.get("updates", {"position": message.get("position")}))
        elif kind == "SetSceneNodeVisibilityMessage":
            self.visible[message["name"]] = message["visible"]
        elif kind == "RemoveSceneNodeMessage":
            self.nodes.pop(message["name"], None)
        elif kind.startswith("SetCamera") and not message.get("initial"):
            self.camera[kind.removeprefix("SetCamera").removesuffix("Message")] = message
        elif kind == "LocalStorageGetItemRequestMessage":
            self._hear(message["request_uuid"])
        elif isinstance(props, dict) and "name" in message:
            self.nodes[message["name"]] = {"kind": kind, **props}


def decode(data: bytes) -> list[dict[str, Any]]:
    """Return the messages of a batch, which has sizes, packed messages, and the arrays to which they refer."""
    plain, packed = (int.from_bytes(data[at : at + 8], "little") for at in (0, 8))
    arrays, at = [], 16 + packed
    inner = msgspec.msgpack.decode(zstandard.ZstdDecompressor().decompress(data[16:at], max_output_size=plain))
    for length in inner.get("binaryBufferLengths", ()):
        at += -at % 8
        arrays.append(data[at : at + length])
        at += length

    def fill(value: Any) -> Any:
        if isinstance(value, dict):
            if "__binary_index" in value:
                return arrays[value["__binary_index"]]
            return {key: fill(item) for key, item in value.items()}
        return value

    return [fill(message) for message in inner["messages"]]
