"""What a viser server shows at a moment, read from the messages that it would send to a browser.

viser's own recordings are a list of such messages with times, so that its player has to repeat all of them to go back.
Here each message is folded into the state of its node, and a moment is the states of all nodes: a player that has two
of them knows what to send to get from one to the other, in either direction.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import viser
from viser import _messages

UNTURNED = (1.0, 0.0, 0.0, 0.0)


@dataclass(frozen=True, slots=True)
class NodeState:
    """A node of the scene.

    Attributes:
        made: Tells it from a node of the same name that was made earlier or later.
        kind: Type of the message that makes it.
        props: What it looks like: arrays, and values as JSON has them.
        position: Where it is.
        wxyz: How it is turned.
        visible: Whether it is shown.
    """

    made: int
    kind: str
    props: Mapping[str, Any]
    position: tuple[float, ...] = (0.0, 0.0, 0.0)
    wxyz: tuple[float, ...] = UNTURNED
    visible: bool = True


Moment = dict[str, NodeState]
"""The nodes of a scene by name."""


class Recorder:
    """Follows what a server shows.

    Args:
        server: Whose scene, empty until now.
    """

    def __init__(self, server: viser.ViserServer) -> None:
        self._nodes: Moment = {}
        self._made = 0
        messages = server._websock_server  # noqa: SLF001 - viser's own serializer can only be read as a whole
        with messages._record_lock:  # noqa: SLF001
            messages._record_handles.append(self)  # type: ignore[arg-type]  # noqa: SLF001

    @property
    def moment(self) -> Moment:
        """What the scene shows now."""
        return dict(self._nodes)

    def _insert_message(self, message: _messages.Message) -> None:
        """Take a message, as viser's own serializer does."""
        if isinstance(message, _messages._CreateSceneNodeMessage):  # noqa: SLF001
            self._made += 1
            self._nodes[message.name] = NodeState(self._made, type(message).__name__, _plain(message)["props"])
            return
        name = getattr(message, "name", None)
        node = self._nodes.get(name) if isinstance(name, str) else None
        if node is not None:
            self._change(node, message)

    def _change(self, node: NodeState, message: Any) -> None:  # noqa: ANN401 - one of viser's many
        match message:
            case _messages.RemoveSceneNodeMessage():
                del self._nodes[message.name]
                return
            case _messages.SceneNodeUpdateMessage():
                node = replace(node, props={**node.props, **_plain(message)["updates"]})
            case _messages.SetPositionMessage():
                node = replace(node, position=tuple(message.position))
            case _messages.SetOrientationMessage():
                node = replace(node, wxyz=tuple(message.wxyz))
            case _messages.SetSceneNodeVisibilityMessage():
                node = replace(node, visible=message.visible)
            case _:
                return
        self._nodes[message.name] = node


def _plain(message: _messages.Message) -> dict[str, Any]:
    """Return a message as it travels, with its arrays in place."""
    buffers: list[memoryview] = []
    return _fill(message.as_serializable_dict(buffers), buffers)  # type: ignore[no-any-return]


def _fill(value: Any, buffers: list[memoryview]) -> Any:  # noqa: ANN401 - JSON and arrays
    match value:
        case {"__binary_index": int(index), "dtype": str(dtype)}:
            return np.frombuffer(buffers[index], dtype=dtype)
        case dict():
            return {name: _fill(item, buffers) for name, item in value.items()}
        case bytes() | bytearray() | memoryview():
            return np.frombuffer(value, dtype=np.uint8)
        case list() | tuple():
            return [_fill(item, buffers) for item in value]
        case np.generic():
            return value.item()
        case _:
            return value
