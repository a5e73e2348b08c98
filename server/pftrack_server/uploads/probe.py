"""Probe: an uploaded file is decoded once, from end to end, in a confined child, before it is anybody's to use.

A file from a stranger is hostile until shown otherwise: it may crash a decoder, keep it busy for ever, or unfold to
more memory than there is. Whatever happens becomes an index of its frames, or a `SourceError` with a sentence.
"""

from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path

from pftrack.core.model.source import FrameIndex
from pftrack.process import MEBIBYTE, Budget, Ending, Fault, Refusal, Reply
from pftrack.sources.limits import Limits, SourceError
from pftrack.sources.results.reading import LARGEST_FILE_BYTES
from pftrack_server.jobs.child_tasks import ChildTasks
from pftrack_server.jobs.functions import index_frames

BUDGET = Budget(cpu_seconds=120, silence_s=240, file_bytes=0, answer_bytes=8 * MEBIBYTE)


async def probe(
    tasks: ChildTasks,
    path: Path,
    limits: Limits,
    *,
    budget: Budget = BUDGET,
    columns: Mapping[str, int] | None = None,
    stopped: Callable[[], bool] | None = None,
) -> FrameIndex:
    """Decode a sequence of pictures once, in a process of its own, without waiting for a turn.

    Args:
        tasks: Where that is done.
        path: The file or folder.
        limits: How large it may be.
        budget: What decoding may take.
        columns: Places of a table's columns by their meaning; its header is rewritten to name them.
        stopped: Asked ten times a second whether to give up.

    Raises:
        SourceError: It is not a sequence of pictures, is broken, exceeds the limits, or the decoder came to grief.
    """
    if columns is not None:
        budget = replace(budget, file_bytes=LARGEST_FILE_BYTES)
    question = str(path), limits, budget.memory_bytes, columns
    answer = await tasks.answer(index_frames, *question, budget=budget, stopped=stopped)
    match answer:
        case Reply(value=str(text)):
            try:
                return FrameIndex.from_json(text)
            except ValueError:
                how = Ending.CRASHED
        case Refusal(message=message):
            raise SourceError(message)
        case Fault():
            raise SourceError("the file cannot be read; the server's log says where reading failed")
        case Ending():
            how = answer
        case _:
            how = Ending.CRASHED
    if stopped is not None and stopped():
        raise SourceError("decoding was stopped before it finished; send the file again")
    raise SourceError(_fate(how, budget))


def _fate(how: Ending, budget: Budget) -> str:
    """Return why a process gave no answer."""
    match how:
        case Ending.OUT_OF_TIME:
            return f"decoding takes longer than the {budget.silence_s:,g} s that are allowed"
        case Ending.OUT_OF_CPU_TIME:
            return f"decoding takes more than the {budget.cpu_seconds:,g} s of processor time that are allowed"
        case Ending.KILLED:
            return "decoding was ended by the system, which may be short of memory; expected a smaller file"
    return "the decoder crashes on this file; expected a file that is not damaged"
