"""Declarations of an experiment in YAML files in its folder, so texts and numbers can be edited without Python.

- `experiment.yaml`: title, question and description, sources, titles and reports of its trackers, its terms, measures,
  plots, readings, layers and worlds;
- `presets.yaml` and, if present, `failures.yaml`: starting points, and typical failures;
- `quality.yaml`: the reliability of bands of error, and the scenes on which the probability of a loss was fitted.

`thumbnail.webp` next to them shows a small run on the start page; `python -m tools.thumbnails` draws it.

Common plots, readings and layers are listed by name only.
"""

from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import cache
from operator import attrgetter
from pathlib import Path
from typing import Any, NamedTuple, NotRequired, TypeVar

from pydantic import TypeAdapter, ValidationError, with_config
from typing_extensions import TypedDict

from pftrack.core.arrays import Floats
from pftrack.core.model import band
from pftrack.core.model.drawing import Key, Layer, Viewpoint, World
from pftrack.core.model.glossary import Term, cite
from pftrack.core.model.measures import EvaluatedRun, Measure
from pftrack.core.model.preset import ExampleSweep, Failure, Preset, Tour, read_failures, read_presets
from pftrack.core.model.series import STANDARD_PLOTS, STANDARD_READINGS, Plot, Reading, Series
from pftrack.core.model.setup import BESIDE
from pftrack.core.model.tracker import Tracker
from pftrack.core.texts import CLOSED, read_texts, refusal
from pftrack.experiments.experiment import NOTHING_MEASURED, STANDARD_QUALITY, Display, Measured, Quality, Texts
from pftrack.experiments.shared.loss_probability import NOTHING_DECLARED, Scenes, read_declaration
from pftrack.experiments.shared.sketch import POINT_LAYERS

for _kind in (
    *(Layer, World, Viewpoint, Plot, Reading, Term, ExampleSweep, Tour, Scenes),
    *(band.Calibration, band.BandTest, band.EstimateBand, band.DeviationBand, band.IntervalBand, band.FlagBand),
):
    with_config(CLOSED)(_kind)  # pydantic refuses unknown fields of them in files; calls in Python are unchanged

KINDS: Mapping[str, tuple[TypeAdapter[Any], str]] = {
    "layers": (TypeAdapter(Layer), "name"),
    "plots": (TypeAdapter(Plot), "id"),
    "readings": (TypeAdapter(Reading), "title"),
    "terms": (TypeAdapter(Term), "name"),
    "series": (TypeAdapter(Series), "name"),
    "reported": (TypeAdapter(Series), "name"),
    "worlds": (TypeAdapter(World), "name"),
    "measures": (TypeAdapter(Measure), "name"),
}
"""Sections that map names to declarations: their type, and the field for the name."""

ERRORS: Callable[[EvaluatedRun], Floats] = attrgetter("errors")
"""Default subject of a file's measure."""

STANDARD: Mapping[str, Mapping[str, object]] = {
    "layers": {layer.name: layer for layer in POINT_LAYERS},
    "plots": {one.id: one for one in STANDARD_PLOTS},
    "readings": {one.title: one for one in STANDARD_READINGS},
    "series": {BESIDE.name: BESIDE},
}
"""Entries with only a name."""


@with_config(CLOSED)
class _Outline(TypedDict):
    title: str
    frames: int
    example_sweep: NotRequired[ExampleSweep]


@with_config(CLOSED)
class _Title(TypedDict):
    title: str
    description: str


class _Said(NamedTuple):
    """The content of `experiment.yaml`: the experiment, its trackers by name, and their reports."""

    outline: _Outline
    texts: Texts
    display: Display
    series: tuple[Series, ...]
    measures: tuple[Measure, ...]
    titles: Mapping[str, _Title]
    reported: tuple[Series, ...]


class Words(_Outline):
    """Fields of an `Experiment` that its folder's files declare."""

    texts: Texts
    display: Display
    measured: Measured
    trackers: Mapping[str, Tracker]
    presets: tuple[Preset, ...]
    failures: tuple[Failure, ...]
    quality: Quality


@with_config(CLOSED)
class _Quality(TypedDict):
    calibration: NotRequired[band.Calibration]
    scenes: NotRequired[Scenes]
    signals: NotRequired[tuple[str, ...]]


T = TypeVar("T")

_OUTLINE, _TITLES, _QUALITY = TypeAdapter(_Outline), TypeAdapter(dict[str, _Title]), TypeAdapter(_Quality)


def read_words(
    folder: Path,
    trackers: Mapping[str, Tracker],
    shared: Path | None = None,
    measured: Measured = NOTHING_MEASURED,
    frames: Mapping[str, Callable[[EvaluatedRun], Floats]] | None = None,
) -> Words:
    """Return the declarations in the files of an experiment's folder.

    Args:
        folder: Folder with `experiment.yaml`, `presets.yaml`, and optionally `failures.yaml`, `quality.yaml` and
            `loss_probability.json`.
        trackers: Trackers by name; they get their titles and descriptions from the first file.
        shared: A file with declarations that several experiments use by name.
        measured: Series and measures that precede those of the first file.
        frames: By name of a measure of the file, the values of the frames; of others those are the errors.

    Raises:
        ValueError: A file is not YAML, or lacks a field, or has an unknown or wrong one, or speaks of a tracker that is
            not there; it names the file, and the line where one is wrong.
    """
    said, failures = _read(folder, shared), folder / "failures.yaml"
    if list(trackers) != list(said.titles):
        given = f"{', '.join(said.titles)}; expected {', '.join(trackers)}"
        raise ValueError(f"{folder.name}/experiment.yaml: it has titles of the trackers {given}")
    values = {each.name: each.frames for each in said.measures} | dict(frames or {})
    if unknown := list(values)[len(said.measures) :]:
        raise ValueError(f"{folder.name}/experiment.yaml: it lacks the measures {', '.join(unknown)}")
    declared = (replace(each, frames=values[each.name]) for each in said.measures)
    series = (*measured.series, *said.series)
    return {
        **said.outline,
        "texts": said.texts,
        "display": replace(said.display, thumbnail=folder / "thumbnail.webp"),
        "measured": replace(measured, series=series, measures=(*measured.measures, *declared)),
        "trackers": {name: replace(tracker, **said.titles[name]) for name, tracker in trackers.items()},
        "quality": _read_quality(folder, trackers),
        "presets": read_presets(folder / "presets.yaml"),
        "failures": read_failures(failures) if failures.exists() else (),
    }


def read_worlds(folder: Path, shared: Path | None = None) -> tuple[World, ...]:
    """Return the worlds that `experiment.yaml` in a folder declares; its errors are those of `read_words`."""
    return _read(folder, shared).display.worlds


def read_reported(folder: Path, shared: Path | None = None) -> dict[str, Series]:
    """Return the reported series by name from `experiment.yaml` in a folder; errors as for `read_words`."""
    return {series.name: series for series in _read(folder, shared).reported}


@cache
def _read(folder: Path, shared: Path | None = None) -> _Said:
    known = STANDARD if shared is None else {**STANDARD, **_shared(shared)}
    path = folder / "experiment.yaml"
    declared, places = read_texts(path)
    try:
        references = tuple(cite(key, place or "") for key, place in declared.get("references", {}).items())
    except ValueError as error:
        raise ValueError(f"{places['references']}: {error}") from error
    sections = {name: _section(name, given, path, places, known) for name, given in declared.items()}
    titles = _validate(_TITLES, sections.pop("trackers", {}), path, places, "trackers")
    series, measures, reported = (sections.pop(name, ()) for name in ("series", "measures", "reported"))
    sections["references"] = references
    texts, display = _part(Texts, sections, path, places), _part(Display, sections, path, places)
    outline = _validate(_OUTLINE, sections, path, places)
    return _Said(outline, texts, display, series, measures, titles, reported)


def _part(kind: type[T], sections: dict[str, Any], path: Path, places: Mapping[str, str]) -> T:
    """Return a part of an experiment from the sections named like its fields, and remove these sections."""
    names = [name for name in kind.__dataclass_fields__ if name in sections]  # type: ignore[attr-defined]
    return _validate(TypeAdapter(kind), {name: sections.pop(name) for name in names}, path, places)


def _read_quality(folder: Path, trackers: Mapping[str, Tracker]) -> Quality:
    path = folder / "quality.yaml"
    if not path.exists():
        return STANDARD_QUALITY
    declared, places = read_texts(path)
    said = _validate(_QUALITY, declared, path, places)
    loss, scenes = NOTHING_DECLARED, said.get("scenes")
    if scenes is not None:
        loss = read_declaration(folder / "loss_probability.json", trackers, scenes, said.get("signals", ()))
    return Quality(said.get("calibration", band.STANDARD_CALIBRATION), loss)


def _shared(path: Path) -> dict[str, Mapping[str, object]]:
    """Return by section what a file declares for several experiments, and what is standard."""
    declared, places = read_texts(path)
    known: dict[str, Mapping[str, object]] = {}
    for section, given in declared.items():
        read = _section(section, given, path, places, STANDARD)
        own = dict(zip(given, read, strict=True)) if section in KINDS else given
        known[section] = {**STANDARD.get(section, {}), **own}
    return known


def _section(
    section: str,
    given: Any,  # noqa: ANN401 - as in the file
    path: Path,
    places: Mapping[str, str],
    known: Mapping[str, Mapping[str, object]],
) -> Any:  # noqa: ANN401
    """Return a section's declarations in their order; a section without names is returned unchanged."""
    standard = known.get(section, {})
    if not isinstance(given, dict):
        return given
    if section not in KINDS:
        return {name: standard.get(name) if fields is None else fields for name, fields in given.items()}
    adapter, key = KINDS[section]
    return tuple(
        standard[name]
        if fields is None and name in standard
        else _validate(adapter, {**_fields(section, fields), key: name}, path, places, section, name)
        for name, fields in given.items()
    )


def _fields(section: str, fields: Any) -> Mapping[str, Any]:  # noqa: ANN401 - as in the file
    if section == "measures":
        return {"frames": ERRORS, **(fields or {})}
    if section == "terms" and isinstance(fields, str):
        return {"meaning": fields}
    if section == "layers" and fields and "legend" in fields:
        return {**fields, "legend": tuple(Key(colour, meaning) for colour, meaning in fields["legend"].items())}
    if section == "worlds" and fields and "viewpoints" in fields:
        sides = tuple({"name": name, **side} for name, side in fields["viewpoints"].items())
        return {**fields, "viewpoints": sides}
    return fields or {}


def _validate(
    adapter: TypeAdapter[T],
    values: object,
    path: Path,
    places: Mapping[str, str],
    *above: str,
) -> T:
    try:
        return adapter.validate_python(values)
    except ValidationError as error:
        raise refusal(error, places, f"{path.parent.name}/{path.name}", *above) from error
