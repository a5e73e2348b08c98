"""What is computed of lessons once and kept: a light answer does not wait behind a heavy lesson."""

import asyncio
from collections.abc import Callable
from pathlib import Path
from typing import Any, cast

from pftrack.core.refusal import RefusedError
from pftrack_server.jobs.child_tasks import ChildTasks
from pftrack_server.teaching.lessons import AGAIN_S, LessonResults
from tests.apart import run


class Answers:
    """Children that answer at once, or never."""

    async def run_beside(self, function: Callable[[], Any], **_: object) -> dict[str, list[int]]:
        if function is heavy:
            await asyncio.Event().wait()
        if function is refused:
            raise RefusedError("There is nothing to compute")
        return {"numbers": [1]}


def heavy() -> None:
    """What takes minutes."""


def light() -> None:
    """What takes a moment."""


def refused() -> None:
    """What cannot be computed."""


async def answer_beside(folder: Path) -> None:
    results = LessonResults(folder, cast("ChildTasks", Answers()))
    results.open()
    slow = [await results.get(f"slow {number}", heavy) for number in range(2)]
    job = await results.get("quick", light)
    assert job.task is not None
    await asyncio.wait_for(job.task, 60)
    assert job.result == {"numbers": [1]}
    assert [each.result for each in slow] == [None, None]
    failed = await results.get("refused", refused)
    assert failed.task is not None
    await asyncio.wait_for(failed.task, 60)
    assert (failed.result, failed.problem) == (None, "There is nothing to compute.")
    assert await results.get("refused", refused) is failed, "nobody tries again at once"
    failed.ended = -AGAIN_S
    assert await results.get("refused", refused) is not failed
    await results.close()


def test_a_light_answer_does_not_wait_for_heavy_ones(tmp_path: Path, monkeypatch: Any) -> None:
    """However many lessons are computed that take minutes; and one that is refused says why."""
    monkeypatch.setattr("pftrack_server.teaching.lessons.MOMENT_S", 0.05)
    run(answer_beside(tmp_path / "kept"))
