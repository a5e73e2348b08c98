"""Records: a run as one small file that computes to the same numbers again.

A `.pft` file is a zip archive of `run.json` (experiment, tracker, seed, timeline, a reference to the source with its
hash, the hash of all estimates) and `diagnostics.npz` (every frame's numbers, for a look without computing). With
`states=True` the particles of every frame come along in `states.npz`. It is written beside its place and renamed, so
that a crash leaves the old file or the new one, never half of one.
"""

import io
import json
import os
import zipfile
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, Literal

import numpy as np
from pydantic import BaseModel, ConfigDict, ValidationError

from pftrack import __version__
from pftrack.experiment import Experiment, Setup
from pftrack.experiments import find
from pftrack.parameters import ParameterError, Value
from pftrack.runs.run import Change, Run
from pftrack.sources.sequence import FrameSequence
from pftrack.sources.truth import Truth, TruthKind

__all__ = ["Record", "RecordError", "describe", "load", "read", "rebuild", "save"]

LARGEST_RECORD_BYTES = 16 * 1024 * 1024

OpenSequence = Callable[[Mapping[str, Any]], FrameSequence]
"""Find the pictures that a saved reference (name, sha256, box, start, and what the writer added) speaks of."""


class RecordError(ValueError):
    """A file that is no run, or a run whose source is not to be had; the sentence says which."""


class SavedChange(BaseModel):
    """One entry of the timeline."""

    model_config = ConfigDict(extra="forbid")

    frame: int
    values: dict[str, Value]


class Record(BaseModel):
    """What `run.json` holds."""

    model_config = ConfigDict(extra="ignore")

    format: Literal["pftrack-run"]
    version: Literal[1]
    pftrack: str
    experiment: str
    tracker: str
    seed: int
    frames: int
    computed: int
    timeline: list[SavedChange]
    reference: dict[str, Any]
    estimates_sha256: str


def describe(run: Run) -> Record:
    """Return what has to be known of a run to compute it again."""
    return Record(
        format="pftrack-run",
        version=1,
        pftrack=__version__,
        experiment=run.experiment.id,
        tracker=run.tracker,
        seed=run.seed,
        frames=run.frames,
        computed=run.head + 1,
        timeline=[SavedChange(frame=change.frame, values=dict(change.values)) for change in run.timeline],
        reference=dict(run.setup.reference),
        estimates_sha256=run.estimates_sha256,
    )


def save(run: Run, path: Path, *, states: bool = False) -> None:
    """Write a run to a file.

    Args:
        run: As far as it has been computed.
        path: Where to; an existing file is replaced.
        states: Whether to keep the particles of every frame; the run is computed once more for that.

    Raises:
        OSError: The file cannot be written; what was there before is still there.
    """
    part = path.with_name(f".{path.name}.{os.getpid()}.part")
    try:
        with zipfile.ZipFile(part, "w", zipfile.ZIP_DEFLATED) as archive:
            archive.writestr("run.json", describe(run).model_dump_json(indent=1))
            archive.writestr("diagnostics.npz", _packed(_columns(run)))
            if states:
                archive.writestr("states.npz", _packed(_states(run)))
        part.replace(path)
    finally:
        part.unlink(missing_ok=True)


def read(path: Path) -> Record:
    """Read what a file says of its run, without computing anything.

    Raises:
        RecordError: It is no saved run, or one that this version does not understand.
    """
    try:
        with zipfile.ZipFile(path) as archive:
            if archive.getinfo("run.json").file_size > LARGEST_RECORD_BYTES:
                raise RecordError(f"{path.name} is no saved run: its description is larger than 16 MiB")
            raw = json.loads(archive.read("run.json"))
    except FileNotFoundError:
        raise RecordError(f"there is no file {path}") from None
    except (OSError, zipfile.BadZipFile, KeyError, ValueError, NotImplementedError, RuntimeError) as error:
        if isinstance(error, RecordError):
            raise
        raise RecordError(f"{path.name} is no saved run, or was cut short; expected a .pft file") from None
    version = raw.get("version") if isinstance(raw, dict) else None
    if isinstance(version, int) and version > 1:
        raise RecordError(f"{path.name} was saved in format {version}, this version reads format 1; update pftrack")
    try:
        return Record.model_validate(raw)
    except ValidationError as error:
        place = ".".join(str(part) for part in error.errors()[0]["loc"])
        raise RecordError(f"{path.name} is no saved run: {place or 'its description'} is missing or wrong") from None


def load(path: Path, *, open_sequence: OpenSequence | None = None) -> Run:
    """Return the run of a file, at its frame 0; computing it gives the saved numbers again.

    Args:
        path: A .pft file.
        open_sequence: How to find the pictures of a run on a recording.

    Raises:
        RecordError: It is no saved run, its source is not to be had, or its parameters are not known here.
    """
    return rebuild(read(path), open_sequence=open_sequence)


def rebuild(record: Record, *, open_sequence: OpenSequence | None = None) -> Run:
    """Return the run that a record describes, at its frame 0; see `load`."""
    try:
        experiment = find(record.experiment)
        return Run(
            experiment,
            _setup(experiment, record.reference, open_sequence),
            tracker=record.tracker,
            seed=record.seed,
            frames=record.frames,
            timeline=tuple(Change(change.frame, change.values) for change in record.timeline),
        )
    except (LookupError, ParameterError) as error:
        raise RecordError(f"the saved run does not fit this version of pftrack: {error}") from None


def _setup(experiment: Experiment, reference: Mapping[str, Any], open_sequence: OpenSequence | None) -> Setup:
    if reference.get("kind") == "simulated":
        return experiment.simulate()
    if reference.get("kind") != "recording":
        raise RecordError("the saved run does not say what it was made on: a simulated scene or a recording")
    name = reference.get("name", "a recording")
    if experiment.on_video is None or open_sequence is None:
        raise RecordError(f"the run was made on {name}, which has to be given along with it")
    sequence = open_sequence(reference)
    if sequence.sha256 != reference.get("sha256"):
        raise RecordError(f"the run was made on {name}; {sequence.name} has other content")
    try:
        box = None
        if reference["box"] is not None:
            x, y, width, height = (float(number) for number in reference["box"])
            box = (x, y, width, height)
        points = {str(name): (float(x), float(y)) for name, (x, y) in reference.get("points", {}).items()}
        return experiment.on_video(
            sequence,
            box,
            start=int(reference["start"]),
            truth=_truth(experiment.truth, reference.get("truth") or {}),
            points=points or None,
        )
    except (KeyError, TypeError, IndexError, ValueError) as error:
        raise RecordError(f"the saved run does not say where on {name} it began: {error}") from None


def _truth(kind: TruthKind, rows: Mapping[str, Any]) -> Truth | None:
    """Return a truth that was saved, held to what a file of its kind may say."""
    form, table = kind.form, {}
    for frame, known in rows.items():
        table[int(frame)] = values = tuple(float(number) for number in known)
        if len(values) != len(form.columns) - 1 or not all(abs(value) <= form.largest for value in values):
            raise ValueError(f"frame {frame} has no {form.one} of {form.unit}")
    return kind.table(table) if table else None


def _columns(run: Run) -> dict[str, np.ndarray[Any, Any]]:
    rows = [row.as_dict() for row in run.diagnostics]
    columns = {name: _column([row[name] for row in rows]) for name in rows[0] if name != "series"}
    for name in run.diagnostics[0].series:
        columns[f"series_{name}"] = _column([row.series[name] for row in run.diagnostics])
    return columns


def _column(values: list[Any]) -> np.ndarray[Any, Any]:
    """Return one value a frame as an array; numbers that are missing become NaN."""
    if any(isinstance(value, str) for value in values):
        return np.array(values, dtype=np.str_)
    width = max((len(value) for value in values if isinstance(value, list | tuple)), default=0)
    missing = [np.nan] * width if width else np.nan
    return np.array([missing if value is None else value for value in values], dtype=np.float64)


def _states(run: Run) -> dict[str, np.ndarray[Any, Any]]:
    twin = run.branch(run.head)
    arrays: dict[str, np.ndarray[Any, Any]] = {}
    for frame in range(run.head + 1):
        for name, array in twin.seek(frame).state.arrays().items():
            arrays[f"{name}_{frame}"] = array
    return arrays


def _packed(arrays: Mapping[str, np.ndarray[Any, Any]]) -> bytes:
    buffer = io.BytesIO()
    np.savez_compressed(buffer, **arrays)  # type: ignore[arg-type] # numpy's stub takes allow_pickle for one of them
    return buffer.getvalue()
