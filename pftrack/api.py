"""The main functions for work in Python; `pftrack` itself offers them.

    >>> import pftrack
    >>> run = pftrack.run("ball", preset="works", seed=3)
    >>> run.export("ball.parquet")

Each step is also available on its own: experiments (`pftrack.experiments`), recipes and records (`pftrack.runs`),
comparisons (`pftrack.runs.comparison`) and viewers (`pftrack.output.exports.formats`).
"""

import json
import warnings
from collections.abc import Mapping, Sequence
from os import PathLike
from pathlib import Path
from typing import Any, Literal

from pftrack.core.files import read_source, read_text
from pftrack.core.model.parameters import Value
from pftrack.core.model.recipe import Change, Footage, Recipe
from pftrack.core.model.source import FrameSequence, Truth
from pftrack.core.refusal import ParameterError, RefusedError
from pftrack.experiments import find, find_for
from pftrack.experiments.experiment import Experiment
from pftrack.experiments.own.code import trust_filters
from pftrack.experiments.own.extension import experiment_of, name_of
from pftrack.output.exports.formats import Watcher
from pftrack.runs import record as records
from pftrack.runs.comparison import Comparison
from pftrack.runs.reproduction import OpenSequence, make, wire
from pftrack.runs.run import Run
from pftrack.sources.beliefs.recorder import Recorder, Sources
from pftrack.sources.formats import is_beliefs
from pftrack.sources.limits import DEFAULT_LIMITS, LARGE_LIMITS, Limits
from pftrack.sources.results.parts import Part, open_parts
from pftrack.sources.sequence import open_sequence
from pftrack.sources.truth import TruthKind, remarks_on

__all__ = ["compare", "load", "record", "run"]

PathOrName = str | PathLike[str]


def run(
    experiment: str | Recipe | Mapping[str, Any],
    *,
    tracker: PathOrName | None = None,
    preset: str | None = None,
    seed: int | None = None,
    frames: int | None = None,
    recording: PathOrName | None = None,
    mark: Mapping[str, Any] | None = None,
    box: Sequence[float] | None = None,
    start: int | None = None,
    truth: PathOrName | Mapping[int, Sequence[float]] | None = None,
    truth_first_frame: int | None = None,
    large: bool = False,
    finish: bool = True,
    **parameters: Value,
) -> Run:
    """Compute a run and return it, at its last frame.

    Args:
        experiment: Its name, or a recipe, which the other arguments change.
        tracker: Name of the tracker, or a file with a filter, FILE.py; by default the experiment's choice.
        preset: Name of a starting point, with its tracker, parameters and seed.
        seed: Random seed; by default that of the preset or the recipe, else 0.
        frames: Length; by default that of the recording or the experiment.
        recording: A video, an animated GIF, PNG or WebP, a folder of pictures, a table of tracks or a recording of
            beliefs; the simulated scene without.
        mark: The target in the picture `start`, as its kind writes it, such as {"kind": "box", "x": 80, ...}; it is
            looked for if not given, where that can be done.
        box: Short for a mark that is a box: x, y, width and height, px.
        start: Number of the first picture; by default the first with a truth, or 0.
        truth: Truth of the recording's pictures: a file, or values by number of the picture.
        truth_first_frame: Number of that file's first frame; detected by default.
        large: Whether pictures may have up to 8K and files 16 GiB, which take time and memory.
        finish: Whether to compute all frames; else the run is at its frame 0.
        **parameters: Values of frame 0 by name, as the experiment declares them.

    Warns:
        UserWarning: How the recording and the file were read, where that could be otherwise, as the command says it.

    Raises:
        RefusedError: The experiment or the preset is unknown.
        FilterFileError: The filter in the file fails; the error names the line.
        OSError: The file with the filter cannot be read.
        ParameterError: A value is unknown or out of bounds.
        RefusedError: The recording is missing, is another one, or shows no target.
    """
    recipe = _recipe(experiment)
    if tracker is not None and str(tracker).endswith(".py"):
        tracker, recipe = _with_filter(recipe, Path(tracker))
    wiring = experiment_of(recipe)
    chosen = wiring.preset_named(preset) if preset is not None else None
    values = {**(chosen.parameters if chosen else {}), **parameters}
    if box is not None:
        if mark is not None or len(box) != 4:
            raise ParameterError("box", list(box), "x, y, width and height, and the only mark")
        mark = dict(zip(("kind", "x", "y", "width", "height"), ("box", *box), strict=True))
    known = None if truth is None or isinstance(truth, Mapping) else _read_truth(wiring, Path(truth), truth_first_frame)
    rows = truth if isinstance(truth, Mapping) else known and known.rows
    if start is None and rows and not (recipe.footage and mark is None):
        start = min(rows)
    said = {
        "tracker": (str(tracker) if tracker is not None else None) or (chosen.tracker if chosen else None),
        "seed": seed if seed is not None else (chosen.seed if chosen else None),
        "frames": frames,
        "timeline": (*recipe.timeline, Change(0, values)) if values else None,
        "footage": _footage(recipe.footage, recording, {"mark": mark, "start": start, "truth": rows}),
    }
    changed = recipe.model_copy(update={name: it for name, it in said.items() if it is not None})
    told: list[str] = []
    limits = LARGE_LIMITS if large else DEFAULT_LIMITS
    opener = _opener(recording, told, limits=limits, truth=(wiring.video.truth, known))
    made = Run.from_recipe(changed, wiring, wire(wiring, changed.footage, opener))
    _warn(told)
    begun = changed.footage.start if changed.footage else 0
    if rows and not any(begun <= frame < begun + made.frames for frame in rows):
        raise RefusedError(f"expected a truth of frames {begun} to {begun + made.frames - 1}, got none of these")
    if finish:
        made.finish()
    return made


def record(
    path: PathOrName,
    source: Sources = None,
    *,
    components: Sequence[str] = (),
    units: Sequence[str] = (),
    frame_rate_hz: float = 30.0,
    precision: Literal["single", "double"] = "single",
    embed: bool = True,
    watch: bool = False,
) -> Recorder:
    """Begin a file of the beliefs of your own loop; `load` opens it as a run.

        with pftrack.record("mine.pft", source="clip.mp4") as rec:
            for t, frame in enumerate(frames):
                ...
                rec(t, particles=states, log_weights=log_weights, ancestors=ancestors)

    Args:
        path: Output file, usually .pft; an existing file is replaced at once.
        source: Input of the loop: the file of a clip; pictures (height, width, 3) or (height, width), RGB, by number of
            the frame; the times of the frames (T,), s; or nothing.
        components: Names of the states' components.
        units: Units of the components, shown at plots and errors; by default px for the first two, if there are
            pictures.
        frame_rate_hz: Frame rate of frames without clip and times.
        precision: Precision of the particles and their weights in the file.
        embed: Whether to store the content of a clip in the file; otherwise its name and the digest of its content are
            stored.
        watch: Whether to open the scene in a browser and have it follow the loop.

    Raises:
        OSError: The file cannot be written, or the clip not be read.
        ValueError: The source is none of these.
    """
    told: list[Watcher] = []

    def tell(end: bool = False) -> None:
        for watcher in told:
            watcher.end() if end else watcher.tell()

    made = Recorder(
        path,
        source,
        components=components,
        units=units,
        frame_rate_hz=frame_rate_hz,
        precision=precision,
        embed=embed,
        on_written=tell,
        on_closed=lambda: tell(end=True),
    )
    if watch:
        clip = Path(source) if isinstance(source, str | PathLike) and not embed else None
        told.append(Watcher(find_for("beliefs"), Path(path), clip=clip))
    return made


def load(path: PathOrName, *, recording: PathOrName | None = None, trust: bool = False, large: bool = False) -> Run:
    """Return the run of a saved file, computed as far as it had been.

    Args:
        path: A .pft file, a saved run or a recording of beliefs; or a recipe, .json, which is computed to its end.
        recording: Path of its recording, if it differs from the path in the file; for a recording of beliefs its clip,
            if that is not in the file or next to it.
        trust: Whether to execute the filters that the file brings, which may do all that you may.
        large: Whether a recording of beliefs and its clip may be as large as for `run`; a saved run's may.

    Warns:
        UserWarning: As `run` does.

    Raises:
        FilterFileError: It contains a filter that is not trusted, or that fails.
        ParameterError: A value of a recipe is unknown or out of bounds.
        RefusedError: It is neither a saved run nor a recipe, or its recording is missing or is another one.
    """
    file = Path(path)
    if is_beliefs(file):
        return _run_of_beliefs(file, recording, large=large)
    if file.suffix.lower() == ".json":
        recipe = read_recipe(file)
        last = None
    else:
        known = records.read(file)
        recipe, last = known.recipe, known.computed - 1
    if trust:
        trust_filters(recipe)
    told: list[str] = []
    made = make(recipe, open_sequence=_opener(recording, told, file.parent))
    _warn(told)
    made.seek(made.frames - 1 if last is None else last)
    return made


def read_recipe(path: Path) -> Recipe:
    """Return the recipe that a file holds as JSON.

    Raises:
        ParameterError: A value is unknown or out of bounds.
        RefusedError: It is not there, or not JSON.
    """
    try:
        raw = json.loads(read_text(path, records.LARGEST_RECORD_BYTES))
    except ValueError as error:
        told = f"{path.name} is not JSON: {error}" if isinstance(error, json.JSONDecodeError) else str(error)
        raise RefusedError(told) from None
    return Recipe.read(raw)


def _run_of_beliefs(file: Path, clip: PathOrName | None, *, large: bool) -> Run:
    """Return the run of a recording of beliefs; by default its clip is taken from the file, or from its folder."""
    if clip is None:
        return run(find_for("beliefs").id, recording=file, large=large)
    wiring = find_for("beliefs")
    footage = Footage(name=file.name)
    together: dict[Part, Path] = {"clip": Path(clip), "results": file}
    sequence = open_parts(together, LARGE_LIMITS if large else DEFAULT_LIMITS)
    _warn(sequence.index.warnings)
    setup = wire(wiring, footage, lambda _: sequence)
    made = Run.from_recipe(Recipe(experiment=wiring.id, footage=footage), wiring, setup)
    made.finish()
    return made


def compare(*runs: Run) -> Comparison:
    """Return the comparison of two to four runs, with all frames computed that they have in common.

    Raises:
        RefusedError: They are too few or too many, their units differ, or they have no frame in common.
    """
    return Comparison.of(*runs).finish()


def _with_filter(recipe: Recipe, file: Path) -> tuple[str, Recipe]:
    """Return the tracker that a file defines, and a recipe that contains it; naming a file means trusting it."""
    name = name_of(file)
    filters = {**recipe.filters, name: (read_source(file),)}
    changed = recipe.model_copy(update={"filters": filters})
    trust_filters(changed)
    return name, changed


def _recipe(said: str | Recipe | Mapping[str, Any]) -> Recipe:
    if isinstance(said, Recipe):
        return said
    return Recipe(experiment=find(said).id) if isinstance(said, str) else Recipe.read(dict(said))


def _read_truth(wiring: Experiment, file: Path, first_frame: int | None) -> Truth:
    if wiring.video.truth is None:
        raise ParameterError("truth", str(file), f"left out: {wiring.id} takes none")
    return wiring.video.truth.read(file, first_frame)


def _warn(told: Sequence[str]) -> None:
    for remark in told:
        warnings.warn(remark, stacklevel=3)


def _footage(known: Footage | None, recording: PathOrName | None, said: Mapping[str, Any]) -> Footage | None:
    """Return the footage of a recipe, or of a new recording, with the target's marks."""
    changes = {name: value for name, value in said.items() if value is not None}
    if known is None and recording is None:
        if changes:
            raise ParameterError("recording", None, f"given, for {' and '.join(changes)} belong to a recording")
        return None
    if known is not None and not changes:
        return None
    if known is None or "mark" in changes:
        known = Footage(name=Path(recording or (known.name if known else "")).name)
    return Footage.model_validate({**known.model_dump(), **changes})


def _opener(
    recording: PathOrName | None,
    told: list[str],
    folder: Path | None = None,
    limits: Limits = LARGE_LIMITS,
    truth: tuple[TruthKind | None, Truth | None] = (None, None),
) -> OpenSequence | None:
    """Return a finder of a recipe's pictures: at the given path, else in the folder of the recipe's file.

    It adds remarks on the pictures and their truth to `told`.
    """

    def open_footage(footage: Footage) -> FrameSequence:
        beside = (folder or Path()) / (footage.path or footage.name)
        place = beside if recording is None else Path(recording)
        if not place.exists():
            raise RefusedError(f"the run was made on {place}, which does not exist; give its path as `recording`")
        sequence = open_sequence(place, limits, square=footage.square)
        told.extend(remarks_on(sequence, *truth))
        return sequence

    return open_footage if recording is not None or folder is not None else None
