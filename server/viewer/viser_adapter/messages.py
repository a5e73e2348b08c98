"""viser's messages that must not pass, and those from a browser that may.

viser lets any browser open a public tunnel to the server, upload files into its memory, ask for renders, drag nodes and
assign any attribute of a control, and has no public way to refuse. So only what the scene and the panel need is passed
on to it, and the handlers of tunnel and uploads are removed.
"""

import msgspec
import viser
from viser import _messages

__all__ = ["is_welcome", "remove_handlers"]

CONTROL = _messages.GuiUpdateMessage.__name__
WELCOME = frozenset(
    {
        _messages.ViewerCameraMessage.__name__,
        _messages.LocalStorageGetItemResponseMessage.__name__,
        CONTROL,
    }
)
"""What a browser may say; a message carries the name of its class as its type."""
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


def is_welcome(data: bytes) -> bool:
    """Whether a message from a browser is one that the scene or the panel needs.

    A `GuiUpdateMessage` may set nothing but a value: viser would assign any attribute of the control that it names.
    """
    try:
        message = _DECODER.decode(data)
    except (msgspec.MsgspecError, ValueError, RecursionError):
        return False
    if message.type == CONTROL:
        return message.updates.keys() == {"value"}
    return message.type in WELCOME


def remove_handlers(server: viser.ViserServer) -> None:
    """Make a server deaf to requests for a tunnel and to uploads, should any ever get past `is_welcome`."""
    for message in UNWANTED:
        server._websock_server.unregister_handler(message)  # noqa: SLF001 - there is no public way
