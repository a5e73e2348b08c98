"""Functions that run in confined processes: on uploads and experiments.

A function that may take minutes is a generator: it yields the steps done and the total, and returns its result.
"""

import base64
import math
import os
import time
from collections.abc import Generator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeAlias

import cv2
import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, Field

from pftrack.analysis.failures import FailureRun, Measured, entry, measure, run_failure
from pftrack.core.model.marks import read_mark
from pftrack.core.model.series import Known
from pftrack.core.model.setup import Sighting
from pftrack.core.model.source import FrameSequence
from pftrack.core.refusal import ParameterError, RefusedError
from pftrack.experiments import EXPERIMENTS, find
from pftrack.sources.limits import Limits
from pftrack.sources.results.parts import RESULTS
from pftrack.sources.results.table import rename
from pftrack.sources.results.writing import LARGEST_FILE_BYTES
from pftrack.sources.sequence import Recording, open_sequence
from pftrack.sources.truth import within
from pftrack.vision.rendering import over

# How long one request searches a recording; a client that wants to continue asks again.
SEARCH_S = 1.5
SUITABILITY_WIDTH_PX = 480
MEBIBYTE = 1024**2

Steps: TypeAlias = Generator[tuple[int, int], None, dict[str, Any]]


def do_nothing() -> bool:
    """Do nothing; the answer proves that processes can start."""
    return True


def index_frames(path: str, limits: Limits, memory_bytes: int, columns: Mapping[str, int] | None = None) -> str:
    """Decode every frame of an untrusted file, and return its index as JSON.

    Args:
        path: The file or folder.
        limits: Limits of its size.
        memory_bytes: Memory limit of this process.
        columns: Column numbers of a table by their meaning; they are written to its header.
    """
    # A decoder needs neither tokens nor passwords. Memory forked into this process may still hold them.
    os.environ.clear()
    try:
        if columns is not None:
            _name_columns(Path(path, RESULTS) if Path(path).is_dir() else Path(path), columns)
        sequence = open_sequence(Path(path), limits)
    except MemoryError:
        allowed = f"{memory_bytes / MEBIBYTE:,.4g} MiB"
        raise RefusedError(f"decoding needs more than the allowed {allowed} of memory") from None
    sequence.close()
    return sequence.index.to_json()


def _name_columns(path: Path, columns: Mapping[str, int]) -> None:
    """Write a header to a table with the column names that a person chose."""
    content = rename(path.read_bytes(), columns) if path.stat().st_size <= LARGEST_FILE_BYTES else b""
    if not 0 < len(content) <= LARGEST_FILE_BYTES:
        raise RefusedError(f"columns can be named in a table of at most {LARGEST_FILE_BYTES // MEBIBYTE} MiB")
    path.write_bytes(content)


class FailureSide(BaseModel):
    """The result of one of a failure's two runs."""

    errors: list[Known] = Field(description="Error in each frame; null where the truth is unknown")
    lost: list[bool] = Field(description="Whether the target is lost, for each frame")
    shown: bool = Field(description="Whether the run fails in this way")
    finding: str = Field(description="Finding in the run's numbers, a sentence")
    numbers: dict[str, Known] = Field(description="Numbers behind the finding; empty if the run does not fail this way")
    why: str = Field(description="Cause of the loss, derived from the run's numbers alone, a sentence")


class FailureResult(BaseModel):
    """Both runs of a failure, computed on this server."""

    unit: str
    frame: int | None = Field(description="Frame of the first loss; null if the target is not lost here")
    measured: tuple[Measured, ...] = Field(description="Medians, and shares of frames in %, from that frame on")
    failing: FailureSide
    cured: FailureSide


def run_with_and_without_cure(failure_id: str) -> dict[str, Any]:
    """Run a failure without and with its cure, and return the fields of a `FailureResult`."""
    shown = entry(EXPERIMENTS, failure_id)
    failing, cured = (run_failure(shown, cured=it) for it in (False, True))
    return FailureResult(
        unit=shown.experiment.judge.unit,
        frame=failing.diagnosis.frame,
        measured=measure(failing, cured),
        failing=_side(failing),
        cured=_side(cured),
    ).model_dump(mode="json")


def _side(done: FailureRun) -> FailureSide:
    return FailureSide(
        errors=[math.nan if row.error is None else row.error for row in done.rows],
        lost=[row.is_lost for row in done.rows],
        shown=done.shown,
        finding=done.finding,
        numbers=done.sign.numbers if done.sign else {},
        why=done.diagnosis.sentence,
    )


def frame_jpeg(recording: Recording, number: int) -> bytes:
    """Return a frame of an upload as JPEG."""
    return _jpeg(_open_at(recording, number).picture(number))


def _jpeg(picture_rgb: NDArray[np.uint8]) -> bytes:
    done, encoded = cv2.imencode(".jpg", cv2.cvtColor(picture_rgb, cv2.COLOR_RGB2BGR))
    if not done:
        raise RefusedError("the frame cannot be drawn")
    return encoded.tobytes()


@dataclass(frozen=True, slots=True)
class TargetSearch:
    """Where to search for a target.

    Attributes:
        experiment: Identifier of the experiment.
        frame: First frame of the upload to search.
        last: Last frame to search, not before the first; None for the upload's last.
        looked: Number of candidate frames already searched.
        hint: The target's place that a person marked in the first frame, as JSON values of a mark.
    """

    experiment: str
    frame: int
    last: int | None = None
    looked: int = 0
    hint: Mapping[str, Any] | None = None


def find_mark(recording: Recording, question: TargetSearch) -> dict[str, Any]:
    """Search an upload for a target for a while, and return the result."""
    finder = find(question.experiment).video.finder
    if finder is None:
        raise RefusedError(f"the experiment {question.experiment} cannot find its target automatically; mark it")
    sequence = _open_at(recording, question.frame)
    if question.hint is not None:
        hint = read_mark(finder.hints, question.hint)
        if finder.within is None:
            raise RefusedError(f"the experiment {question.experiment} cannot search part of a picture for its target")
        try:
            seen = finder.within(sequence, question.frame, hint)
        except ValueError as error:
            raise RefusedError(str(error)) from None
        return _sighting_json(seen, 1, 1)
    end = sequence.frame_count - 1
    last = end if question.last is None else min(question.last, end)
    if last < question.frame:
        raise ParameterError("last", question.last, f"a frame from {question.frame} on")
    frames = finder.frames(question.frame, last)
    until, looked = time.monotonic() + SEARCH_S, min(question.looked, len(frames) - 1)
    for seen in finder.search(sequence, frames[looked:]):
        looked += 1
        # A mere guess is enough in the frame that was asked for; other frames are not searched for one.
        if seen.sure or (seen.mark is not None and len(frames) == 1) or time.monotonic() > until:
            break
    if seen.sure and question.last is None:
        seen = finder.better(sequence, seen)
    guessed = seen.mark is not None and not seen.sure and len(frames) > 1
    return _sighting_json(Sighting(seen.frame) if guessed else seen, looked, len(frames))


def weigh_target(recording: Recording, experiment_id: str, frame: int, raw: Mapping[str, Any]) -> dict[str, Any]:
    """Judge whether the trackers of an experiment can follow a target marked in a frame of an upload."""
    experiment = find(experiment_id)
    sequence = _open_at(recording, frame)
    experiment.check_footage(sequence.index.kind)
    if experiment.video.suits is None:
        raise RefusedError(f"the experiment {experiment_id} cannot judge beforehand whether it can track a target")
    mark = experiment.video.mark(raw)
    try:
        setup = experiment.video.on_video(sequence, mark, start=frame)
    except ParameterError:
        raise
    except ValueError as error:
        raise RefusedError(str(error)) from None
    assert setup.footage is not None  # noqa: S101 - a recording has one
    found = experiment.video.suits(sequence, setup.footage, setup.parameters)
    remark, *advice = found.sentences
    picture = None
    if found.likelihood is not None:
        shown = _jpeg(over(sequence.picture(frame), found.likelihood, width=SUITABILITY_WIDTH_PX))
        picture = f"data:image/jpeg;base64,{base64.b64encode(shown).decode()}"
    return {
        "value": found.value,
        "grade": found.grade,
        "remark": remark,
        "advice": advice,
        "better": found.better.model_dump(mode="json") if found.better else None,
        "picture": picture,
    }


def _sighting_json(seen: Sighting, looked: int, of: int) -> dict[str, Any]:
    return {
        "frame": seen.frame,
        "mark": seen.mark.model_dump(mode="json") if seen.mark else None,
        "placed": list(seen.placed),
        "remarks": [f"{remark[:1].upper()}{remark[1:]}." for remark in seen.remarks],
        "looked": looked,
        "of": of,
    }


def read_truth(path: str, experiment_id: str, frames: int, size: tuple[int, int]) -> dict[str, Any]:
    """Read a truth table for an upload, of the kind that an experiment takes."""
    kind, name = find(experiment_id).video.truth, Path(path).name
    if kind is None:
        raise RefusedError(f"the experiment {experiment_id} takes no truth")
    try:
        table = kind.read(Path(path), None)
    except RefusedError as error:
        # Hide the server's own name and path of the file.
        message = str(error).removeprefix(f"{name}: ")
        if path in message:
            message = "the file cannot be read"
        elif message.startswith(name):
            message = f"the file{message.removeprefix(name)}"
        raise RefusedError(message) from None
    rows, warnings = within(kind, table, frames, size)
    return {"frames": len(rows), "first": min(rows), "last": max(rows), "warnings": warnings, "rows": rows}


def _open_at(recording: Recording, number: int) -> FrameSequence:
    """Open an upload and check that it has a frame."""
    sequence = recording.open()
    if not 0 <= number < sequence.frame_count:
        raise ParameterError("frame", number, f"a frame of the upload, 0 to {sequence.frame_count - 1}")
    return sequence
