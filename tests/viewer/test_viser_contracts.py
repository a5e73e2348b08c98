"""What viser does not promise and the adapter relies on, where no test of the adapter itself would fail."""

import contextlib
import dataclasses
import inspect
import re
from collections.abc import Iterator
from pathlib import Path

import msgspec
import pytest
import viser
from viser import _messages
from viser.infra import _infra

from pftrack_server.viewer import viser_messages as messages
from pftrack_server.viewer import viser_server
from tests.viewer.host import SAID, Loop

VERSION = f"viser {viser.__version__}"
ROOT = Path(__file__).parents[2]
ROOMS = ("pftrack", "server", "frontend_static")
VIEWER = ROOT / "server" / "pftrack_server" / "viewer"
ADAPTER = {VIEWER / f"{name}.py" for name in ("client_page", "viser_handles", "viser_messages", "viser_server")}
PRIVATE = ("viser._", "from viser import _", "viser.infra", "__viser", "mantine", "_websock_server")

HANDLED = {
    *("CommandTriggerMessage", "GuiButtonHoldMessage", "GuiFormDirtyMessage", "GuiFormSubmitMessage"),
    *("GuiUpdateMessage", "SceneNodeClickMessage", "SceneNodeDragMessage", "ScenePointerMessage"),
    *(f"TransformControls{kind}Message" for kind in ("DragEnd", "DragStart", "Update")),
}
"""Messages that a server of this version takes from browsers, apart from those that the adapter removes: judged
harmless, or dropped."""


@contextlib.contextmanager
def started() -> Iterator[viser.ViserServer]:
    """Run a server in a loop in another thread."""
    loop = Loop()
    server, reached = loop.call(viser_server.start, "Ball")
    try:
        yield server
    finally:
        loop.call(server.stop)
        loop.call(reached.wait_closed)
        loop.close()


def test_only_the_adapter_uses_internals_of_viser() -> None:
    """An upgrade of viser changes one folder."""
    found = [
        f"{file.relative_to(ROOT)}: {word}"
        for room in ROOMS
        for file in (ROOT / room).rglob("*")
        if file.suffix in {".py", ".js", ".css", ".html"}
        and file not in ADAPTER
        and VIEWER / "client" not in file.parents
        and not {"node_modules", "vendor"} & {*file.parts}
        for word in PRIVATE
        if word in file.read_text(encoding="utf-8")
    ]
    assert found == [], "only the adapter in server/pftrack_server/viewer may use these"


def test_viser_uses_the_replaced_clock_only_for_the_times_of_messages() -> None:
    """The clock runs fast in all of viser's connection layer, so nothing else there may measure time by it."""
    used = re.findall(r"\btime\.\w+", inspect.getsource(_infra))
    assert used == ["time.perf_counter"], f"{VERSION} uses {used} of the clock that viser_server replaces"
    assert '"timestampSec": time.perf_counter()' in inspect.getsource(_infra._message_producer), (
        f"{VERSION} no longer takes the sending time of a message from time.perf_counter; see viser_server"
    )


def test_handlers_of_unwanted_messages_are_removed() -> None:
    """Without them, no browser can open a tunnel or upload a file."""
    with started() as server:
        handled = {kind.__name__ for kind in server._websock_server._incoming_handlers}
    still = handled & {kind.__name__ for kind in messages.UNWANTED}
    assert not still, f"{VERSION} still handles {still}"
    assert handled <= HANDLED, (
        f"{VERSION} takes {sorted(handled - HANDLED)} from browsers, which nobody has judged: "
        "decide whether viser_messages should remove them"
    )


@pytest.mark.parametrize("name", sorted(messages.WELCOME))
def test_a_message_has_the_name_of_its_class(name: str) -> None:
    """The list of allowed messages consists of names."""
    kind = getattr(_messages, name)
    assert kind in _messages.Message.get_subclasses(), f"{VERSION} has no message {name}"
    fields = {field.name for field in dataclasses.fields(kind) if field.init}
    assert fields == SAID[name].keys(), f"{name} of {VERSION} has other fields"
    assert messages.kind_of(msgspec.msgpack.encode({"type": name, **SAID[name]})) == name
