"""Pictures that never change: a browser keeps them for a day, and no cache that others share keeps them at all."""

from starlette.responses import Response

DAY_S = 24 * 3600


def kept_picture(data: bytes, media_type: str) -> Response:
    """Return the answer with a picture of somebody's own recording or run."""
    return Response(data, media_type=media_type, headers={"Cache-Control": f"private, max-age={DAY_S}"})
