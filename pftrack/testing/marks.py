"""Checks of the kinds of mark that an experiment takes: described whole, and refusing what is not a mark of theirs."""

import math
from collections.abc import Iterator
from typing import Any

from pftrack.core.model.drawing import Drawing
from pftrack.core.model.marks import Editor, Mark
from pftrack.core.model.parameters import ParameterError
from pftrack.experiments.experiment import Experiment
from pftrack.testing.check import Check, CheckError, demand, named_checks
from pftrack.vision.rendering import render

SIZE = (320, 240)
"""Width and height of the picture in which marks are made, px."""


def checks(experiment: Experiment) -> Iterator[Check]:
    """Yield the checks of this module."""
    yield from named_checks(
        experiment,
        [
            ("its kinds of mark describe themselves", _kinds_describe_themselves),
            ("bad marks are refused with their field", _bad_marks_are_refused),
            ("marks survive their JSON and can be drawn", _marks_survive),
        ],
    )


def _kinds_describe_themselves(experiment: Experiment) -> None:
    kinds, finder = experiment.video.marks, experiment.video.finder
    if not experiment.accepts_video:
        demand(not kinds, f"the experiment takes no recordings, and has {len(kinds)} kinds of mark")
    for kind in (finder.kind, *finder.hints) if finder else ():
        demand(kind in kinds, f"the finder's {kind.name()} must be among the kinds that the experiment takes")
    names = [kind.name() for kind in kinds]
    demand(len(names) == len(set(names)), f"kinds of mark must have names of their own, got {', '.join(names)}")
    for kind in kinds:
        editor = kind.editor()
        name = kind.name()
        demand(editor.kind == name, f"the editor of {name} is one of {editor.kind}")
        demand(kind.title[:1].isupper(), f"{name} must have a title in sentence case, got {kind.title!r}")
        demand(
            kind.instruction.endswith("."), f"the instruction of {name} must be a sentence, got {kind.instruction!r}"
        )
        demand(editor.handles or editor.numbers, f"an editor of {name} has nothing to drag and nothing to type")
        _demand_consistent(name, editor)


def _demand_consistent(name: str, editor: Editor) -> None:
    handles = {handle.name for handle in editor.handles}
    for handle in editor.handles:
        within = all(0 <= share <= 1 for share in handle.at)
        demand(within, f"{handle.name} of {name} must begin within the picture, got {handle.at} of its size")
    for number in editor.numbers:
        ordered = number.minimum <= number.default <= number.maximum and number.step > 0
        demand(ordered, f"the default of {number.name} of {name} must lie within its bounds, with a step above 0")
        about = number.about
        demand(about is None or about in handles, f"{number.name} of {name} is about {about!r}, which is no handle")
    unknown = {end for link in editor.links for end in link} - handles
    demand(not unknown, f"{name} joins handles that it does not have: {', '.join(sorted(unknown))}")


def _bad_marks_are_refused(experiment: Experiment) -> None:
    if not experiment.video.marks:
        return
    for raw in ({"kind": "no such kind"}, {}, "no mark", None, 7):
        _demand_refusal(experiment, raw, "what is no mark")
    for kind in experiment.video.marks:
        good = at_first(kind)
        _demand_refusal(experiment, {**good, "no_such_field": 1}, f"a {kind.name()} with an unknown field")
        editor = kind.editor()
        for number in editor.numbers:
            for value in (math.nan, math.inf, -1e9, 1e9, "many", None):
                _demand_refusal(experiment, _with(good, number.name, value), f"{number.name} = {value!r}")
        for handle in editor.handles:
            for place in ([math.nan, 1.0], [-1e9, 1.0], [1.0, 1e9], [-SIZE[0], -SIZE[1]], [1.0], "here", None):
                _demand_refusal(experiment, _with(good, handle.name, place), f"{handle.name} at {place!r}")


def _demand_refusal(experiment: Experiment, raw: object, what: str) -> None:
    try:
        experiment.video.mark(raw).check(SIZE)
    except ParameterError as error:
        place = error.field.split(".")[0]
        demand(place == "mark", f"{what} must be refused with a field of the mark, got {error.field!r}")
    except Exception as error:
        raise CheckError(f"{what} must be refused with a ParameterError, got {type(error).__name__}") from error
    else:
        raise CheckError(f"{what} must be refused in a picture of {SIZE[0]} x {SIZE[1]} px, and was accepted")


def _marks_survive(experiment: Experiment) -> None:
    for kind in experiment.video.marks:
        mark = experiment.video.mark(at_first(kind))
        again = experiment.video.mark(mark.model_dump(mode="json"))
        demand(again == mark, f"a {kind.name()} must come back from its JSON, got {again!r} for {mark!r}")
        mark.check(SIZE)
        drawn = dict(mark.draw())
        layers = {item.layer for item in drawn.values()}
        demand(layers == {"mark"}, f"a {kind.name()} must be drawn on the layer 'mark', got {sorted(layers)}")
        shape = render(Drawing(*SIZE, drawn)).shape
        demand(shape == (SIZE[1], SIZE[0], 3), f"a {kind.name()} is rendered to the shape {shape}")


def at_first(kind: type[Mark], size: tuple[int, int] = SIZE) -> dict[str, Any]:
    """Return the JSON of a mark as an editor begins with it in a picture of this width and height, px."""
    editor = kind.editor()
    raw: dict[str, Any] = {"kind": kind.name()}
    for handle in editor.handles:
        raw = _with(raw, handle.name, [share * (length - 1) for share, length in zip(handle.at, size, strict=True)])
    for number in editor.numbers:
        raw = _with(raw, number.name, number.default)
    return raw


def _with(raw: dict[str, Any], path: str, value: object) -> dict[str, Any]:
    """Return JSON with another value at a place whose parts are joined by dots."""
    first, _, rest = path.partition(".")
    return {**raw, first: _with(raw.get(first, {}), rest, value) if rest else value}
