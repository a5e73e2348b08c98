"""Probing: an uploaded file is decoded once, from end to end, in a process of its own that can do little harm.

A file from a stranger is hostile until shown otherwise: it may crash a decoder, keep it busy for ever, or unfold to
more memory than there is. So a fresh interpreter without secrets in its environment confines itself before it looks at
the file (`pftrack.process`), decodes every picture of it, and answers with one line of JSON, or dies. Whatever happens
becomes a `Probe` or a `SourceError` with a sentence.
"""

import contextlib
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import IO

from pydantic import TypeAdapter, ValidationError

from pftrack.process import Ending, command, confine, end_group, ending, environment
from pftrack.sources.sequence import DEFAULT_LIMITS, FrameIndex, Kind, Limits, SourceError, open_sequence

__all__ = ["Probe", "probe"]

_MEBIBYTE = 1024**2
_LONGEST_ANSWER_BYTES = 8 * _MEBIBYTE
_FILES = 64
_GRACE_SECONDS = 5
_LOOK_S = 0.1


@dataclass(frozen=True, slots=True)
class Probe:
    """Description of a sequence that was decoded from end to end.

    Attributes:
        name: The file's or folder's own name.
        kind: What it is made of.
        frames: How many frames decode.
        width: Of every picture, turned upright, px.
        height: Of every picture, turned upright, px.
        frame_rate_hz: Frames a second; the mean where the rate varies.
        duration_s: How long it lasts.
        sha256: Digest of the content.
        warnings: Sentences for people about what is odd.
        index: For `open_sequence`, which then opens at once.
    """

    name: str
    kind: Kind
    frames: int
    width: int
    height: int
    frame_rate_hz: float
    duration_s: float
    sha256: str
    warnings: tuple[str, ...]
    index: FrameIndex


@dataclass(frozen=True, slots=True)
class _Question:
    path_hex: str
    limits: Limits
    memory_bytes: int
    cpu_seconds: float
    wall_seconds: float


@dataclass(frozen=True, slots=True)
class _Answer:
    index: FrameIndex | None = None
    refusal: str | None = None
    out_of_memory: bool = False


_QUESTION, _ANSWER = TypeAdapter(_Question), TypeAdapter(_Answer)


def probe(
    path: Path,
    limits: Limits = DEFAULT_LIMITS,
    *,
    memory_bytes: int = 1024 * _MEBIBYTE,
    cpu_seconds: float = 120,
    wall_seconds: float = 240,
    stopped: Callable[[], bool] = lambda: False,
) -> Probe:
    """Decode a sequence of pictures once, in a process of its own; may be called from any thread.

    Args:
        path: The file or folder.
        limits: How large it may be.
        memory_bytes: What decoding may take, beyond the bare interpreter.
        cpu_seconds: Processor time that it may take.
        wall_seconds: Time that it may take.
        stopped: Asked ten times a second whether to give up.

    Raises:
        SourceError: It is not a sequence of pictures, is broken, exceeds the limits, or the decoder came to grief.
    """
    question = _Question(os.fsencode(path.absolute()).hex(), limits, memory_bytes, cpu_seconds, wall_seconds)
    with tempfile.TemporaryFile() as answers:
        status = _ask(question, answers, stopped)
        answers.seek(0)
        text = answers.read(_LONGEST_ANSWER_BYTES + 1)
    try:
        answer = _ANSWER.validate_json(text)
    except ValidationError:
        answer = _Answer()
    if answer.refusal is not None:
        raise SourceError(answer.refusal)
    if answer.out_of_memory:
        raise SourceError(
            f"decoding needs more than the {memory_bytes / _MEBIBYTE:,.4g} MiB of memory that are allowed"
        )
    if answer.index is None and stopped():
        raise SourceError("decoding was stopped before it came to an end; give the file again")
    if answer.index is None or status != 0:
        raise SourceError(_fate(status, question))
    return _describe(path.name, answer.index)


def _ask(question: _Question, answers: IO[bytes], stopped: Callable[[], bool]) -> int | None:
    """Run the process; return its exit status, or None if it had to be ended for lasting too long."""
    process = subprocess.Popen(  # noqa: S603 - this very Python and a module of ours
        command("pftrack.sources.probe"),
        stdin=subprocess.PIPE,
        stdout=answers,
        stderr=subprocess.DEVNULL,
        env=environment(bare=True),
        close_fds=True,
        start_new_session=True,
    )
    end = time.monotonic() + question.wall_seconds
    asked: bytes | None = _QUESTION.dump_json(question)
    try:
        while time.monotonic() < end and not stopped():
            with contextlib.suppress(subprocess.TimeoutExpired):
                process.communicate(asked, timeout=_LOOK_S)
                return process.returncode
            asked = None
        return None
    finally:
        if process.poll() is None:
            end_group(process.pid)
            process.wait()


def _fate(status: int | None, question: _Question) -> str:
    """Return why a process gave no answer."""
    match ending(status):
        case Ending.OUT_OF_TIME:
            return f"decoding takes longer than the {question.wall_seconds:,g} s that are allowed"
        case Ending.OUT_OF_CPU_TIME:
            return f"decoding takes more than the {question.cpu_seconds:,g} s of processor time that are allowed"
        case Ending.KILLED:
            return "decoding was ended by the system, which may be short of memory; expected a smaller file"
    return "decoding the file makes the decoder crash; expected a file that is not damaged"


def _describe(name: str, index: FrameIndex) -> Probe:
    return Probe(
        name=name,
        kind=index.kind,
        frames=index.frame_count,
        width=index.width,
        height=index.height,
        frame_rate_hz=index.frame_rate_hz,
        duration_s=index.times_s[-1] + 1 / index.frame_rate_hz,
        sha256=index.sha256,
        warnings=index.warnings,
        index=index,
    )


def _limit(question: _Question) -> None:
    """Confine this process to what decoding needs."""
    confine(
        memory_bytes=question.memory_bytes,
        cpu_seconds=question.cpu_seconds,
        wall_seconds=question.wall_seconds + _GRACE_SECONDS,  # should nobody be left to end this process
        file_bytes=_LONGEST_ANSWER_BYTES,
        open_files=_FILES,
    )


def _answer(question: _Question) -> _Answer:
    try:
        sequence = open_sequence(Path(os.fsdecode(bytes.fromhex(question.path_hex))), question.limits)
        sequence.close()
        return _Answer(index=sequence.index)
    except SourceError as error:
        return _Answer(refusal=str(error))
    except MemoryError:
        return _Answer(out_of_memory=True)


def main() -> None:
    """Answer the question on standard input, in the confined process."""
    # The decoders themselves are trusted; they are loaded before memory gets scarce.
    import pftrack.sources.images  # noqa: PLC0415
    import pftrack.sources.video  # noqa: F401, PLC0415

    question = _QUESTION.validate_json(sys.stdin.buffer.read())
    _limit(question)
    answer = _answer(question)
    sys.stdout.buffer.write(_ANSWER.dump_json(answer))


if __name__ == "__main__":
    main()
