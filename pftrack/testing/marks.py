"""Checks of the kinds of mark that an experiment takes: what an editor makes by their description can be used."""

import json
from collections.abc import Iterator
from functools import partial
from typing import Any

import numpy as np

from pftrack.drawing import Drawing
from pftrack.experiment import Experiment
from pftrack.marks import Mark
from pftrack.parameters import ParameterError
from pftrack.rendering import render
from pftrack.testing.check import Check, CheckError, demand, named

__all__ = ["checks"]

SIZE = (320, 240)


def checks(experiment: Experiment) -> Iterator[Check]:
    """Yield the checks of this module, one of the experiment and some of each kind."""
    if not experiment.accepts_video:
        return
    yield from named(experiment, [("its target can be marked or found", _can_begin)])
    for kind in experiment.marks:
        for name, function in (
            ("a mark made by its description is read, fits and is drawn", _is_sound),
            ("wrong marks are refused with their field", _refuses),
        ):
            yield Check(f"{name} ({kind.name()})", partial(function, experiment, kind))


def _can_begin(experiment: Experiment) -> None:
    names = [kind.name() for kind in experiment.marks]
    demand(len(set(names)) == len(names), f"kinds of mark must have different names, got {', '.join(names)}")
    finder = experiment.finder
    demand(names or finder, "an experiment on recordings must take a kind of mark, or find its target by itself")
    if finder is not None:
        for kind in (finder.kind, *finder.hints):
            demand(kind in experiment.marks, f"the finder's {kind.name()} must be among the kinds that are taken")


def _is_sound(experiment: Experiment, kind: type[Mark]) -> None:
    raw = _by_description(kind)
    mark = experiment.mark(raw)
    mark.check(SIZE)
    again = experiment.mark(json.loads(mark.model_dump_json()))
    demand(again == mark, f"a mark of kind {kind.name()} must be the same again after its JSON")
    drawn = dict(mark.draw())
    layers = {item.layer for item in drawn.values()}
    demand(
        layers == {"mark"}, f'a mark must be drawn in the layer "mark", got {", ".join(sorted(layers)) or "nothing"}'
    )
    shape = render(Drawing(*SIZE, drawn)).shape
    demand(shape == (SIZE[1], SIZE[0], 3), f"a mark of kind {kind.name()} is rendered to the shape {shape}")


def _refuses(experiment: Experiment, kind: type[Mark]) -> None:
    raw = _by_description(kind)
    wrong = [{**raw, "no such field": 1}, {**raw, "kind": "no such kind"}]
    wrong += [_with(raw, handle.name, [np.inf, 0.0]) for handle in kind.editor().handles]
    wrong += [_with(raw, number.name, "much") for number in kind.editor().numbers]
    for values in wrong:
        try:
            experiment.mark(values)
        except ParameterError:
            continue
        raise CheckError(f"a mark of kind {kind.name()} must refuse {values}")
    if not (kind.editor().handles or kind.editor().numbers):
        return
    try:
        experiment.mark(raw).check((1, 1))
    except ParameterError:
        return
    raise CheckError(f"a mark of kind {kind.name()} must not fit a picture of 1 x 1 px, got {raw}")


def _by_description(kind: type[Mark]) -> dict[str, Any]:
    """Return the mark that an editor begins with, as JSON values."""
    editor = kind.editor()
    raw: dict[str, Any] = {"kind": editor.kind}
    for handle in editor.handles:
        raw = _with(raw, handle.name, [handle.at[0] * (SIZE[0] - 1), handle.at[1] * (SIZE[1] - 1)])
    for number in editor.numbers:
        raw = _with(raw, number.name, number.default)
    return raw


def _with(raw: dict[str, Any], path: str, value: object) -> dict[str, Any]:
    """Return JSON values with another one at a place; the parts of the path are joined by dots."""
    first, _, rest = path.partition(".")
    return {**raw, first: _with(raw.get(first, {}), rest, value) if rest else value}
