"""What is computed of lessons once and kept: a light answer does not wait behind a heavy lesson."""

import asyncio
from collections.abc import Callable
from pathlib import Path
from typing import Any, cast

from pftrack.process import Outcome, Reply
from pftrack_server.jobs.child_tasks import ChildTasks
from pftrack_server.teaching.lessons import LessonResults
from tests.apart import run


class Answers:
    """Children that answer at once, or never."""

    async def answer(self, function: Callable[[], Any], **_: object) -> Outcome:
        if function is heavy:
            await asyncio.Event().wait()
        return Reply({"numbers": [1]})


def heavy() -> None:
    """What takes minutes."""


def light() -> None:
    """What takes a moment."""


async def answer_beside(folder: Path) -> None:
    results = LessonResults(folder, cast("ChildTasks", Answers()))
    results.open()
    slow = [await results.get(f"slow {number}", heavy) for number in range(2)]
    job = await results.get("quick", light)
    assert job.task is not None
    await asyncio.wait_for(job.task, 60)
    assert job.result == {"numbers": [1]}
    assert [each.result for each in slow] == [None, None]
    await results.close()


def test_a_light_answer_does_not_wait_for_heavy_ones(tmp_path: Path, monkeypatch: Any) -> None:
    """However many lessons are computed that take minutes."""
    monkeypatch.setattr("pftrack_server.teaching.lessons.MOMENT_S", 0.05)
    run(answer_beside(tmp_path / "kept"))
