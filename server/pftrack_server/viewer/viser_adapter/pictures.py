"""Pictures that are JPEG files already; viser's `add_image` takes pixels only, and encodes them itself."""

import viser
from viser import _messages


def add_jpeg(
    server: viser.ViserServer,
    name: str,
    file: bytes,
    extent: tuple[float, float],
    *,
    wxyz: tuple[float, float, float, float],
    position: tuple[float, float, float],
) -> viser.ImageHandle:
    """Add a picture to the scene as `add_image` does, without shadows.

    Args:
        server: Whose scene.
        name: Of the node.
        file: The JPEG file.
        extent: Width and height in the scene.
        wxyz: Its turn.
        position: Its centre.
    """
    width, height = extent
    props = _messages.ImageProps(
        _format="jpeg",
        _data=file,
        render_width=width,
        render_height=height,
        cast_shadow=False,
        receive_shadow=False,
        scale=1.0,
    )
    message = _messages.ImageMessage(name=name, props=props)
    return viser.ImageHandle._make(server.scene, message, name, wxyz, position, visible=True)


def replace_jpeg(handle: viser.ImageHandle, file: bytes) -> None:
    """Show another file in the place of a picture that `add_jpeg` has added."""
    handle._data = file  # noqa: SLF001 - there is no public way
