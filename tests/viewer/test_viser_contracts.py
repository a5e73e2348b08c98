"""What viser does not promise and the adapter rests on: each test says what has changed when a new version breaks it.

What a server rests on is in `test_viser_server`, since it decides whether one is started at all.
"""

import asyncio
import contextlib
import dataclasses
import inspect
import re
from collections.abc import Iterator
from pathlib import Path
from types import SimpleNamespace
from typing import Any
from unittest.mock import AsyncMock

import msgspec
import numpy as np
import pytest
import viser
from viser import _messages
from viser.infra import _infra
from viser.infra._async_message_buffer import AsyncMessageBuffer

from pftrack_server.viewer import viser_handles, viser_server
from pftrack_server.viewer import viser_messages as messages
from pftrack_server.viewer.client_page import client_parts, original_page
from tests.viewer.host import Loop, decode, names_of

VERSION = f"viser {viser.__version__}"
ROOT = Path(__file__).parents[2]
ROOMS = ("pftrack", "server", "frontend_static")
VIEWER = ROOT / "server" / "pftrack_server" / "viewer"
ADAPTER = {VIEWER / f"{name}.py" for name in ("client_page", "viser_handles", "viser_messages", "viser_server")}
PRIVATE = re.compile(r"\bviser\._|from viser import _|viser\.infra|__viser|mantine|_websock_server")

HANDLED = {
    "CommandTriggerMessage",
    "GuiButtonHoldMessage",
    "GuiFormDirtyMessage",
    "GuiFormSubmitMessage",
    "GuiUpdateMessage",
    "SceneNodeClickMessage",
    "SceneNodeDragMessage",
    "ScenePointerMessage",
    "TransformControlsDragEndMessage",
    "TransformControlsDragStartMessage",
    "TransformControlsUpdateMessage",
}
"""What a server of this version takes from browsers beside what the adapter removes, judged harmless or dropped."""


LOOK: dict[str, Any] = {
    "cast_shadow": False,
    "receive_shadow": False,
    "wxyz": (0.0, 1.0, 0.0, 0.0),
    "position": (1.0, 2.0, 3.0),
}
"""How a picture lies in the scene."""

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
"""What browsers say in good order."""


@contextlib.contextmanager
def started() -> Iterator[viser.ViserServer]:
    """Have a server in a loop beside this thread."""
    loop = Loop()
    server, reached = loop.call(viser_server.start, "Ball")
    try:
        yield server
    finally:
        loop.call(server.stop)
        loop.call(reached.wait_closed)
        loop.close()


def test_only_the_adapter_touches_what_is_private() -> None:
    """An upgrade of viser is a matter of one room."""
    found = [
        f"{file.relative_to(ROOT)}:{number}: {line.strip()}"
        for room in ROOMS
        for file in (ROOT / room).rglob("*")
        if file.suffix in {".py", ".js", ".css", ".html"}
        and file not in ADAPTER
        and VIEWER / "client" not in file.parents
        and "node_modules" not in file.parts
        for number, line in enumerate(file.read_text(encoding="utf-8").splitlines(), 1)
        if PRIVATE.search(line)
    ]
    assert found == [], "only the adapter in server/pftrack_server/viewer may know these"


def test_the_clock_serves_nothing_but_the_times_of_messages() -> None:
    """It is made to run fast for the whole of viser's connection layer, so nothing else there may tell time by it."""
    used = names_of(inspect.getsource(_infra), "time")
    assert used == ["perf_counter"], f"{VERSION} uses {used} of the clock that viser_server replaces"
    assert '"timestampSec": time.perf_counter()' in inspect.getsource(_infra._message_producer), (
        f"{VERSION} no longer says by time.perf_counter when a message was sent; see viser_server"
    )


def test_messages_and_connections_are_where_the_adapter_takes_hold() -> None:
    """Messages are handled in one place: what cannot be taken is dropped with a warning, not with a traceback each.

    A browser's connection is known by its number, so that one that does not keep up can be held without the others.
    """
    source = inspect.getsource(_infra.WebsockServer._background_worker)
    for line in ("self._handle_incoming_message(client_id, message)", "self._live_connections[client_id] = connection"):
        assert line in source, f"{VERSION} has no longer {line}; see viser_messages and viser_server"


def test_unwanted_messages_have_handlers_that_can_be_removed() -> None:
    """Once removed, neither a tunnel can be opened nor a file uploaded."""
    with started() as server:
        handled = {kind.__name__ for kind in server._websock_server._incoming_handlers}
    still = handled & {kind.__name__ for kind in messages.UNWANTED}
    assert not still, f"{VERSION} still handles {still}"
    assert handled <= HANDLED, (
        f"{VERSION} takes {sorted(handled - HANDLED)} from browsers, which nobody has judged: "
        "decide whether viser_messages should remove them"
    )


@pytest.mark.parametrize("name", sorted(messages.WELCOME))
def test_a_message_goes_by_the_name_of_its_class(name: str) -> None:
    """The list of what a browser may say is one of names."""
    kind = getattr(_messages, name)
    assert kind in _messages.Message.get_subclasses(), f"{VERSION} has no message {name}"
    fields = {field.name for field in dataclasses.fields(kind) if field.init}
    assert fields == SAID[name].keys(), f"{name} of {VERSION} has other fields"
    assert messages.kind_of(msgspec.msgpack.encode({"type": name, **SAID[name]})) == name


async def test_a_question_travels_as_a_message_of_visers() -> None:
    """It is asked past viser's queues, in the form in which viser sends what a browser takes up in order."""
    fields = [field.name for field in dataclasses.fields(_messages.LocalStorageGetItemRequestMessage)]
    assert fields == ["key", "request_uuid"], f"{VERSION} asks for an item by {fields}; see messages.question"

    buffer = AsyncMessageBuffer(asyncio.get_running_loop(), persistent_messages=True)
    buffer.push(_messages.LocalStorageGetItemRequestMessage(key=messages.KEY, request_uuid=messages.KEY))
    websocket: Any = SimpleNamespace(send=AsyncMock(side_effect=lambda _: buffer.set_done()))
    await _infra._message_producer(websocket, buffer, 0)
    ((theirs,), _), *more = websocket.send.call_args_list
    assert not more
    sent_s, asked = decode(theirs)
    assert decode(messages.question(sent_s)) == (sent_s, asked), f"{VERSION} packs messages in another way"


def test_a_picture_travels_as_a_file() -> None:
    """A file that is encoded already takes the place of what viser would encode: nothing else differs."""
    with started() as server:
        theirs = server.scene.add_image("/one", np.zeros((6, 8, 3), np.uint8), 8.0, 6.0, format="jpeg", **LOOK)
        ours = viser_handles.add_jpeg(
            server, "/two", theirs._data, (8.0, 6.0), wxyz=(0.0, 1.0, 0.0, 0.0), position=(1.0, 2.0, 3.0)
        )
        assert vars(ours._impl.props) == vars(theirs._impl.props), f"{VERSION} describes an image in another way"
        assert (ours.position == theirs.position).all()
        assert (ours.wxyz == theirs.wxyz).all()
        queued = server._websock_server.get_message_buffer()
        before = queued.message_counter
        viser_handles.replace_jpeg(ours, b"other")
        last = queued.message_from_id[before]
        assert isinstance(last, _messages.SceneNodeUpdateMessage), f"{VERSION} tells another file by {last}"
        assert (last.name, last.updates) == ("/two", {"_data": b"other"})


def test_the_client_can_be_taken_apart() -> None:
    """Otherwise it is served in one piece: 0.8 MB to be loaded and compiled again for each session.

    Scripts go to the beginning of its head, the style sheet to the end, and its title is replaced.
    """
    assert client_parts() is not None, f"{VERSION} packs its client in another way; see client_page.take_apart"
    page = original_page()
    for place in ("<head>", "</head>", "<title>Viser</title>"):
        assert page.count(place) == 1, f"the client of {VERSION} has {page.count(place)} of {place}"


@pytest.mark.parametrize(
    ("word", "use"),
    [
        ("createObjectURL", "unpacking a picture, as frames.js notices it"),
        ("hasFocus", "reconnecting only with the focus, as page.js grants it"),
        ("darkMode", "the theme in the address, as page.js sets it"),
        ("webgl-software-rendering", "the notice that style.css hides"),
    ],
)
def test_the_client_still_uses_the_words_that_the_scripts_know(word: str, use: str) -> None:
    """A name that is gone from the client means that what rests on it does nothing any more.

    Those that can be seen in a page are looked for in a real one, by `test_client_in_browser`.
    """
    parts = client_parts()
    assert word.encode() in parts.script.content, f"the client of {VERSION} knows no {word}: {use}"
