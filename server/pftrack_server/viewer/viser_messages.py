"""viser's messages: which of a browser's messages pass to viser, and a question of our own.

viser lets any browser open a public tunnel to the server, upload files into its memory, request renders, drag nodes and
assign any attribute of a control, without a public way to forbid that. So only messages that the scene and the panel
need are passed on, and the handlers of tunnel and uploads are removed. A value that a control cannot take, such as a
word for a number, is dropped with a rate-limited warning, where viser would log ten lines for each.

The question asks for an item of the browser's storage that is never set; a browser that blocks its storage answers with
an error, which is just as good. viser's own way to ask blocks a thread for each browser.
"""

from typing import Any

import msgspec
import viser
import zstandard
from viser import _messages
from viser.infra import _messages as infra_messages

from pftrack_server.core.log import RateLimitedLogger

CONTROL = _messages.GuiUpdateMessage.__name__
ANSWER = _messages.LocalStorageGetItemResponseMessage.__name__
"""Kind of the answer to a `question`."""
LOOKING = frozenset({_messages.ViewerCameraMessage.__name__, ANSWER})
"""Messages allowed to a browser that only watches; a message's type is the name of its class."""
WELCOME = LOOKING | {CONTROL, _messages.SceneNodeDragMessage.__name__}
"""Messages allowed to a browser that may steer; only nodes that pftrack made draggable report drags."""
UNWANTED = (
    _messages.ShareUrlRequest,
    _messages.ShareUrlDisconnect,
    _messages.FileTransferStartUpload,
    _messages.FileTransferPart,
)

KEY = "pftrack-echo"


class _Message(msgspec.Struct):
    """The fields of a message that decide whether it passes."""

    type: str
    updates: dict[str, msgspec.Raw] = {}


_DECODER = msgspec.msgpack.Decoder(_Message)


def kind_of(data: bytes, *, looks_only: bool = False) -> str | None:
    """Return the kind of a message from a browser; None unless the scene or the panel needs it.

    Args:
        data: The received bytes.
        looks_only: Whether the browser may only move its camera.

    A `GuiUpdateMessage` may set nothing but a value: viser would assign any attribute of the control that it names.
    """
    try:
        message = _DECODER.decode(data)
    except (msgspec.MsgspecError, ValueError, RecursionError):
        return None
    if message.type not in (LOOKING if looks_only else WELCOME) or (
        message.type == CONTROL and message.updates.keys() != {"value"}
    ):
        return None
    try:
        infra_messages.Message.deserialize(data)
    except Exception:  # noqa: BLE001 - viser would end the connection, whatever it is
        return None
    return message.type


def question(sent_s: float) -> bytes:
    """Return a message that a browser answers once it has processed all earlier messages.

    Args:
        sent_s: Time of sending by viser's clock, s.
    """
    asked = _messages.LocalStorageGetItemRequestMessage(key=KEY, request_uuid=KEY).as_serializable_dict([])
    inner = msgspec.msgpack.encode({"messages": (asked,), "timestampSec": sent_s, "binaryBufferLengths": ()})
    compressed = zstandard.ZstdCompressor(level=1).compress(inner)
    return len(inner).to_bytes(8, "little") + len(compressed).to_bytes(8, "little") + compressed


def drop_bad_values(server: viser.ViserServer) -> None:
    """Make a server drop values that its handlers cannot take, with a rate-limited warning."""
    incoming = server._websock_server  # noqa: SLF001 - there is no public way
    handle = incoming._handle_incoming_message  # noqa: SLF001
    warnings = RateLimitedLogger(__name__)

    async def handle_or_drop(client: Any, message: Any) -> None:  # noqa: ANN401 - viser's own types
        try:
            await handle(client, message)
        except Exception as error:  # noqa: BLE001 - whatever it is, it is the browser's
            warnings.warn(
                "a browser sent a message that its scene cannot handle", kind=type(message).__name__, error=str(error)
            )

    incoming._handle_incoming_message = handle_or_drop  # type: ignore[assignment,method-assign]  # noqa: SLF001


def remove_handlers(server: viser.ViserServer) -> None:
    """Remove a server's handlers of tunnels and uploads, in case such a message passes `kind_of`."""
    for message in UNWANTED:
        server._websock_server.unregister_handler(message)  # noqa: SLF001 - there is no public way
