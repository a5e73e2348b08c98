"""Checks of an experiment's declarations: identity, parameters, presets, plots, readings and kinds of mark."""

import math
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping
from typing import Any

from pftrack.core.model.drawing import Drawing, legend
from pftrack.core.model.marks import Editor, Mark
from pftrack.core.model.parameters import Declaration, Parameters, declarations, revise, with_role
from pftrack.core.model.recipe import Change
from pftrack.core.model.series import Plot, SeriesShape
from pftrack.core.refusal import ParameterError, RefusedError
from pftrack.experiments import NAME, find
from pftrack.experiments.experiment import Experiment
from pftrack.runs.run import Run
from pftrack.sweep import Plan
from pftrack.sweep.axis import Axis, SweepError
from pftrack.sweep.cells import COMMON
from pftrack.sweep.table import FIXED
from pftrack.testing.check import CheckError, begin_run, demand, whole
from pftrack.vision.rendering import render

UNITS = ("_px", "_mm", "_deg", "_rad", "_hz", "_s", "_ms", "_frames")
"""Endings of names that state a unit; the declaration then has to state it as well."""

NUMBERS = ("integer", "number")

SHAPES: Mapping[str, tuple[SeriesShape, ...]] = {
    "value": ("number",),
    "band": ("number",),
    "interval": ("interval",),
    "features": ("vector",),
    "frequency": ("number", "vector"),
    "hypotheses": ("hypotheses",),
    "tree": ("hypotheses",),
}
"""The shapes of series that the kinds of plot draw which read series by name."""


@whole("the registry finds it by its id")
def _is_registered(experiment: Experiment) -> None:
    try:
        found = find(experiment.id)
    except RefusedError as error:
        raise CheckError(f"{experiment.id} must be registered by an entry point: {error}") from None
    demand(found is experiment, f"the registry has another experiment of the name {experiment.id}")


@whole("it says what it is")
def _says_what_it_is(experiment: Experiment) -> None:
    texts = experiment.texts
    for name, text in (("title", experiment.title), *vars(texts).items()):
        demand(text or name == "terms", f"the experiment's {name} must say something, got nothing")
    _demand_end(texts.question, "?", "the experiment's question")
    _demand_end(texts.description, ".", "the experiment's description")
    demand(experiment.frames > 1, f"a simulated run needs two frames at least, got {experiment.frames}")
    demand(experiment.trackers, "an experiment needs a tracker")
    for name, tracker in experiment.trackers.items():
        demand(tracker.id == name, f"the tracker under the name {name!r} has the id {tracker.id!r}")
        _demand_name(name, "tracker")
        demand(tracker.title, f"the tracker {name} must have a title")
        _demand_end(tracker.description, ".", f"the description of the tracker {name}")
        _demand_words(tracker.title, f"the title of the tracker {name}")
        _demand_words(tracker.description, f"the description of the tracker {name}")


@whole("its parameters are declared whole")
def _declares_parameters(experiment: Experiment) -> None:
    for declared in declarations(type(experiment.simulate().parameters)):
        name = declared.name
        demand(declared.title[:1].isupper(), f"{name} must have a title in sentence case, got {declared.title!r}")
        _demand_end(declared.description, ".", f"the help of {name}, the docstring below it,")
        _demand_words(declared.title, f"the title of {name}")
        _demand_words(declared.description, f"the help of {name}")
        demand(declared.group, f"{name} must have a group: the heading under which a panel shows it")
        unknown = set(declared.trackers) - set(experiment.trackers)
        demand(not unknown, f"{name} names trackers that the experiment does not have: {', '.join(sorted(unknown))}")
        demand(declared.unit or not name.endswith(UNITS), f"{name} has a unit in its name and declares none")
        if declared.kind in NUMBERS:
            _demand_bounds(declared)


def _demand_bounds(declared: Declaration) -> None:
    low, high = declared.minimum, declared.maximum
    demand(
        low is not None and high is not None and declared.step,
        f"{declared.name} must have bounds and a step, got {low} to {high} in steps of {declared.step}",
    )
    if low is not None and high is not None:
        demand(
            low <= float(declared.default) <= high,
            f"the default of {declared.name} must lie between {low:g} and {high:g}, got {declared.default}",
        )


@whole("bad values are refused with their field")
def _refuses_bad_values(experiment: Experiment) -> None:
    parameters = experiment.simulate().parameters
    for declared in declarations(type(parameters)):
        for value in _bad(declared):
            _demand_value_refusal(parameters, declared.name, value)
    _demand_value_refusal(parameters, "no_such_parameter", 1)


def _bad(declared: Declaration) -> Iterator[object]:
    yield from (None, "no such value", math.nan)
    if declared.kind in NUMBERS:
        yield from (math.inf, -math.inf, 1e300)
        yield from (
            bound + sign for bound, sign in ((declared.minimum, -1), (declared.maximum, 1)) if bound is not None
        )


def _demand_value_refusal(parameters: Parameters, name: str, value: object) -> None:
    _demand_refusal(lambda: revise(parameters, {name: value}), f"{name} = {value!r}", name)


def _demand_refusal(act: Callable[[], object], what: str, field: str, where: str = "") -> None:
    """Demand that something is refused with an error of a field, or of a part of it."""
    try:
        act()
    except ParameterError as error:
        demand(
            error.field.split(".")[0] == field, f"{what} must be refused with its field {field}, got {error.field!r}"
        )
    except Exception as error:
        raise CheckError(f"{what} must be refused with a ParameterError, got {type(error).__name__}") from error
    else:
        raise CheckError(f"{what} must be refused{where}, and was accepted")


@whole("its measures are declared whole")
def _declares_measures(experiment: Experiment) -> None:
    for measure in experiment.run_measures:
        _demand_name(measure.name, "measure")
        demand(measure.name not in COMMON, f"every sweep has {measure.name}: a measure must have another name")
        demand(measure.title, f"the measure {measure.name} must have a title")
        _demand_end(measure.description, ".", f"the description of the measure {measure.name}")
    reductions = [reduction.name for series in experiment.all_series() for reduction in series.reductions]
    parameters = [declared.name for declared in declarations(type(experiment.simulate().parameters))]
    columns = [*FIXED, *parameters, *(measure.name for measure in experiment.run_measures), *reductions]
    _demand_unique(columns, "columns of a sweep (parameters, measures and reductions)")
    decisive = experiment.measure_named(experiment.simulate().success)
    demand(decisive.how == "share", f"success is decided by a share, and {decisive.name} is a {decisive.how}")


@whole("its presets run")
def _presets_run(experiment: Experiment) -> None:
    demand(experiment.presets, "an experiment needs a preset at least: its picture in the gallery is made by it")
    _demand_unique((preset.name for preset in experiment.presets), "presets")
    known = {declared.name for declared in declarations(type(experiment.simulate().parameters))}
    for preset in experiment.presets:
        _demand_name(preset.name, "preset")
        demand(preset.title, f"the preset {preset.name} must have a title")
        if preset.watch:
            _demand_end(preset.watch, ".", f"what to look at in the preset {preset.name}")
        for name in preset.subjects:
            demand(name in known, f"the preset {preset.name} is about {name!r}, which is not a parameter")
        timeline = (Change(0, preset.parameters),) if preset.parameters else ()
        try:
            run = begin_run(experiment, preset.tracker, seed=preset.seed, timeline=timeline)
            run.seek(2)
        except ParameterError as error:
            raise CheckError(f"the preset {preset.name} does not fit the experiment: {error}") from None
        if preset.tour is not None:
            _demand_end(preset.tour.begin, ".", f"the beginning of the tour of the preset {preset.name}")
            _demand_end(preset.tour.reason, ".", f"the reason that the tour of the preset {preset.name} gives")
            whole = Run(experiment, experiment.simulate(), tracker=preset.tracker, seed=preset.seed, timeline=timeline)
            whole.finish()
            lost = any(row.lost for row in whole.diagnostics)
            demand(preset.tour.frame < whole.frames, f"the tour of the preset {preset.name} goes beyond its last frame")
            demand(lost, f"the preset {preset.name} has a tour and never loses its target")


@whole("its example sweep is a plan")
def _example_sweep_is_a_plan(experiment: Experiment) -> None:
    example = experiment.example_sweep
    if example is not None:
        axes = tuple(Axis(name, tuple(values)) for name, values in example.axes.items())
        try:
            Plan(experiment.id, axes, example.trackers, example.trials, frames=example.frames)
        except (SweepError, ParameterError) as error:
            raise CheckError(f"the example sweep does not fit the experiment: {error}") from None


@whole("its plots and readings are complete")
def _declares_plots(experiment: Experiment) -> None:
    _demand_unique((plot.id for plot in experiment.display.plots), "plots")
    demand(experiment.display.readings, "an experiment needs a reading at least: a line of figures for each frame")
    declared = {series.name: series for series in experiment.all_series()}
    for plot in experiment.display.plots:
        demand(plot.title, f"the plot {plot.id} must have a title")
        _demand_end(plot.description, ".", f"the description of the plot {plot.id}")
        shapes = SHAPES.get(plot.kind, ())
        needs = "series by name" if shapes else "no series by name"
        demand(bool(plot.series) == bool(shapes), f"the plot {plot.id} of the kind {plot.kind!r} needs {needs}")
        for name in plot.series:
            shape = declared[name].shape
            demand(
                shape in shapes,
                f"the plot {plot.id} of the kind {plot.kind!r} draws {' or '.join(shapes)}, and {name} is {shape}",
            )
        _demand_parts(plot)
        drawing = [one.name for one in with_role(type(experiment.simulate().parameters), "drawing")]
        demand(
            plot.shown in {"", *drawing},
            f"the plot {plot.id} must be shown by a parameter of the role 'drawing' ({', '.join(drawing)}), "
            f"got {plot.shown!r}",
        )


@whole("its layers are named once, and one explains the estimate")
def _declares_layers(experiment: Experiment) -> None:
    layers = experiment.display.layers
    _demand_unique((layer.name for layer in layers), "layers")
    _demand_unique((layer.title for layer in layers), "titles of layers")
    explained = {key.colour for key in legend(layers)}
    demand("estimate" in explained, "users must see which one is the estimate: a layer's legend has no key")
    shown = [layer.name for layer in layers if layer.role == "through time" and layer.shown]
    demand(not shown, f"who looks from the front sees nothing of {', '.join(shown)}: it must be off at first")
    roles = {layer.role for layer in layers}
    demand(
        "through time" in roles or "flat only" not in roles,
        "a layer through time takes the place of one that is flat only: there must be such a one",
    )


def _demand_parts(plot: Plot) -> None:
    """Check that a plot has everything that its kind needs in addition to its series."""
    wanted = {
        "a level for each series": (len(plot.levels) == len(plot.series), plot.kind == "frequency"),
        "the series of standard deviations": (bool(plot.sd), plot.kind == "band"),
        "the series of what is visible and what was recognised": (
            bool(plot.visible and plot.recognised),
            plot.kind == "features",
        ),
    }
    for part, (is_there, needed) in wanted.items():
        demand(is_there or not needed, f"the plot {plot.id} of the kind {plot.kind!r} needs {part}")


def _demand_end(text: str, end: str, what: str) -> None:
    demand(text.endswith(end), f"{what} must be a sentence that ends in {end!r}, got {text!r}")


def _demand_words(text: str, what: str) -> None:
    """Go on if a text can be shown as it is: what is written for a formula's printer, or for Python, cannot."""
    demand("_" not in text, f"{what} must be in words, without formulas or names that have a _ in them, got {text!r}")


def _demand_name(name: str, what: str) -> None:
    """Go on if a name can be part of addresses and of file names."""
    allowed = "at most 64 lower-case letters, digits, hyphens and underscores"
    demand(NAME.fullmatch(name), f"the name of a {what} must be {allowed}, got {name!r}")


def _demand_unique(names: Iterable[str], what: str) -> None:
    twice = [name for name, count in Counter(names).items() if count > 1]
    demand(not twice, f"{what} must have unique names, got twice {', '.join(twice)}")


SIZE = (320, 240)
"""Width and height of the picture in which marks are made, px."""


@whole("its kinds of mark describe themselves")
def _kinds_describe_themselves(experiment: Experiment) -> None:
    kinds, finder = experiment.video.marks, experiment.video.finder
    if not experiment.accepts_video:
        demand(not kinds, f"the experiment takes no recordings, and has {len(kinds)} kinds of mark")
    for kind in (finder.kind, *finder.hints) if finder else ():
        demand(kind in kinds, f"the finder's {kind.name()} must be among the kinds that the experiment takes")
    names = [kind.name() for kind in kinds]
    demand(len(names) == len(set(names)), f"kinds of mark must have unique names, got {', '.join(names)}")
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
        demand(about is None or about in handles, f"{number.name} of {name} is about {about!r}, which is not a handle")
    unknown = {end for link in editor.links for end in link} - handles
    demand(not unknown, f"{name} joins handles that it does not have: {', '.join(sorted(unknown))}")


@whole("bad marks are refused with their field")
def _bad_marks_are_refused(experiment: Experiment) -> None:
    if not experiment.video.marks:
        return
    for raw in ({"kind": "no such kind"}, {}, "no mark", None, 7):
        _demand_mark_refusal(experiment, raw, "an invalid mark")
    for kind in experiment.video.marks:
        good = at_first(kind)
        _demand_mark_refusal(experiment, {**good, "no_such_field": 1}, f"a {kind.name()} with an unknown field")
        editor = kind.editor()
        for number in editor.numbers:
            for value in (math.nan, math.inf, -1e9, 1e9, "many", None):
                _demand_mark_refusal(experiment, _with(good, number.name, value), f"{number.name} = {value!r}")
        for handle in editor.handles:
            for place in ([math.nan, 1.0], [-1e9, 1.0], [1.0, 1e9], [-SIZE[0], -SIZE[1]], [1.0], "here", None):
                _demand_mark_refusal(experiment, _with(good, handle.name, place), f"{handle.name} at {place!r}")


def _demand_mark_refusal(experiment: Experiment, raw: object, what: str) -> None:
    where = f" in a picture of {SIZE[0]} x {SIZE[1]} px"
    _demand_refusal(lambda: experiment.video.mark(raw).check(SIZE), what, "mark", where)


@whole("marks survive their JSON and can be drawn")
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
