"""Requests for sessions as tests write them: the fields of a recipe and of its footage without their brackets."""

from collections.abc import Mapping
from typing import Any

__all__ = ["session_request"]


def session_request(wish: Any) -> Any:
    """Return the body for `POST /api/v1/sessions`; what is one already, or is none at all, stays as it is."""
    if not isinstance(wish, Mapping) or "recipe" in wish:
        return wish
    rest = dict(wish)
    recipe: dict[str, Any] = {
        name: rest.pop(name) for name in ("experiment", "tracker", "seed", "frames") if name in rest
    }
    values, timeline = rest.pop("parameters", None), rest.pop("timeline", [])
    recipe["timeline"] = [{"frame": 0, "values": values}, *timeline] if values else timeline
    said = {name: rest.pop(name, None) for name in ("box", "points", "start")}
    if rest.get("upload") is not None or said["box"] is not None or said["points"]:
        recipe["footage"] = {"start": said["start"] or 0, "mark": mark_of(said["box"], said["points"])}
    return {**rest, "recipe": recipe}


def mark_of(box: Any, points: Any) -> dict[str, Any] | None:
    """Return the mark that a box of four numbers or points are."""
    if points:
        return {"kind": "points", "points": points}
    if box is None:
        return None
    return {"kind": "box", **dict(zip(("x", "y", "width", "height"), box, strict=False))}
