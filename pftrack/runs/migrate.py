"""Migration: what earlier versions have stored, as this version has it.

Everything here reads JSON values of an earlier form and returns those of the present one; nothing is written back. A
file or a link that somebody keeps for years opens through here.

- A saved run does not say how pixels were taken that are not square (`footage.square`): then as they are stored.
- Version 0.2 said of a run field by field what is now one recipe, and of a recording by `reference` what is now
  `footage`; a mark was a `box` of four numbers, or `points`, or both, of which the points counted.
"""

from collections.abc import Mapping
from typing import Any

from pftrack.model.parameters import Declaration

__all__ = ["mark", "pixels", "record", "request", "session"]


def record(raw: Mapping[str, Any]) -> dict[str, Any]:
    """Return the description of a saved run of format 1 in format 2.

    Raises:
        KeyError: Something is missing.
        TypeError: Something has another form.
    """
    reference = raw["reference"]
    recipe = {name: raw[name] for name in ("experiment", "tracker", "seed", "frames", "timeline")}
    if reference["kind"] != "simulated":
        recipe["footage"] = _footage(reference)
    kept = {name: raw[name] for name in ("format", "pftrack", "computed", "estimates_sha256")}
    return {**kept, "version": 2, "recipe": recipe}


def pixels(raw: Mapping[str, Any]) -> dict[str, Any]:
    """Return the description of a saved run that says how pixels were taken: in files that do not, as they are stored.

    Raises:
        KeyError: Something is missing.
        TypeError: Something has another form.
    """
    recipe = raw["recipe"]
    if not recipe.get("footage"):
        return dict(raw)
    return {**raw, "recipe": {**recipe, "footage": {"square": False, **recipe["footage"]}}}


def request(raw: Mapping[str, Any]) -> dict[str, Any]:
    """Return the request for a session of version 0.2, which is also what its share links hold, as of today.

    What is unknown in it stays where it is, to be refused by name.
    """
    rest = dict(raw)
    recipe: dict[str, Any] = {
        name: rest.pop(name) for name in ("experiment", "tracker", "seed", "frames") if name in rest
    }
    values, timeline = rest.pop("parameters", None), rest.pop("timeline", [])
    recipe["timeline"] = [{"frame": 0, "values": values}, *timeline] if values else timeline
    said = {name: rest.pop(name, None) for name in ("box", "points", "start")}
    if rest.get("upload") is not None or said["box"] is not None or said["points"]:
        recipe["footage"] = {"start": said["start"] or 0, "mark": mark(said["box"], said["points"])}
    return {**rest, "recipe": recipe}


def session(raw: Mapping[str, Any]) -> dict[str, Any]:
    """Return a session that version 0.2 has stored as this one stores it; one of this version stays as it is."""
    if "experiment" not in raw:
        return dict(raw)
    common = {name: raw.get(name) for name in ("experiment", "seed", "frames")}
    if raw.get("upload") is not None:
        common["footage"] = {
            "name": raw.get("upload_name") or "",
            "start": raw["start"],
            "mark": mark(raw.get("box"), raw.get("points")),
        }
    branches = {}
    for name, branch in raw["branches"].items():
        recipe = {**common, "tracker": branch["first_tracker"] or branch["tracker"], "timeline": branch["timeline"]}
        same = {key: branch[key] for key in ("id", "title", "parent", "frame", "tracker", "first_values", "position")}
        branches[name] = {**same, "recipe": recipe, "computed": branch["head"]}
    gone = {"experiment", "seed", "frames", "upload_name", "box", "points", "start"}
    kept = {name: value for name, value in raw.items() if name not in gone}
    return {**kept, "branches": branches, "card": _card(raw.get("card"))}


def _card(card: Mapping[str, Any] | None) -> dict[str, Any] | None:
    """Return what was stored of a session's shape: declarations had less to say, layers were a name and a flag."""
    if card is None:
        return None
    declared = [Declaration.model_validate(item).model_dump(mode="json") for item in card["declarations"]]
    layers = [{"name": name, "shown": shown} for name, shown in card["layers"].items()]
    return {**card, "declarations": declared, "layers": layers}


def mark(box: Any, points: Any) -> dict[str, Any] | None:  # noqa: ANN401 - what was stored, checked by its kind
    """Return the mark that a box and points were, either of which may be missing."""
    if points:
        return {"kind": "points", "points": points}
    if box is None:
        return None
    return {"kind": "box", **dict(zip(("x", "y", "width", "height"), box, strict=False))}


def _footage(reference: Mapping[str, Any]) -> dict[str, Any]:
    return {
        "sha256": reference["sha256"],
        "name": reference["name"],
        "path": reference.get("path"),
        "start": reference["start"],
        "mark": mark(reference["box"], reference.get("points")),
        "truth": reference.get("truth") or None,
    }
