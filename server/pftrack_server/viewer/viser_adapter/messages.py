"""viser's messages that must not pass, and those from a browser that may.

viser lets any browser open a public tunnel to the server, upload files into its memory, ask for renders, drag nodes and
assign any attribute of a control, and has no public way to refuse. So only what the scene and the panel need is passed
on to it, and the handlers of tunnel and uploads are removed. A value that a control cannot take, such as a word for a
number, is dropped with a warning now and then, where viser would write ten lines for each.
"""

from typing import Any

import msgspec
import viser
from viser import _messages
from viser.infra import _messages as infra_messages

from pftrack_server.core.log import RateLimitedLogger

CONTROL = _messages.GuiUpdateMessage.__name__
LOOKING = frozenset({_messages.ViewerCameraMessage.__name__, _messages.LocalStorageGetItemResponseMessage.__name__})
"""What a browser may say that only looks on; a message carries the name of its class as its type."""
WELCOME = LOOKING | {CONTROL}
"""What one may say whose controls count."""
UNWANTED = (
    _messages.ShareUrlRequest,
    _messages.ShareUrlDisconnect,
    _messages.FileTransferStartUpload,
    _messages.FileTransferPart,
)


class _Message(msgspec.Struct):
    """What has to be known of a message to let it through."""

    type: str
    updates: dict[str, msgspec.Raw] = {}


_DECODER = msgspec.msgpack.Decoder(_Message)


def is_allowed(data: bytes, *, looks_only: bool = False) -> bool:
    """Whether a message from a browser is one that the scene or the panel needs.

    Args:
        data: What came.
        looks_only: Whether the browser may move its camera and nothing else.

    A `GuiUpdateMessage` may set nothing but a value: viser would assign any attribute of the control that it names.
    """
    try:
        message = _DECODER.decode(data)
    except (msgspec.MsgspecError, ValueError, RecursionError):
        return False
    if message.type not in (LOOKING if looks_only else WELCOME) or (
        message.type == CONTROL and message.updates.keys() != {"value"}
    ):
        return False
    try:
        infra_messages.Message.deserialize(data)
    except Exception:  # noqa: BLE001 - viser would end the connection, whatever it is
        return False
    return True


def drop_bad_values(server: viser.ViserServer) -> None:
    """Make a server drop what its handlers cannot take, with a warning now and then."""
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
    """Make a server deaf to requests for a tunnel and to uploads, should any ever get past `is_allowed`."""
    for message in UNWANTED:
        server._websock_server.unregister_handler(message)  # noqa: SLF001 - there is no public way
