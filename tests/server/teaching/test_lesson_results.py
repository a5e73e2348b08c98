"""What is computed of lessons once and kept: a light answer does not wait behind a heavy lesson."""

import asyncio
from collections.abc import Callable
from pathlib import Path
from typing import Any, cast

from pftrack.core.refusal import RefusedError
from pftrack_server.jobs.child_tasks import ChildTasks
from pftrack_server.jobs.results import DiskCache
from pftrack_server.teaching.lessons import LessonResults
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


async def answer_beside(folder: Path, monkeypatch: Any) -> None:
    results = LessonResults(DiskCache(folder), cast("ChildTasks", Answers()))
    slow = [await results.get(f"slow {number}", heavy) for number in range(2)]
    job = await results.get("quick", light)
    await results.jobs.wait(job.id, 60)
    assert job.result == {"numbers": [1]}
    assert [each.result for each in slow] == [None, None]
    failed = await results.get("refused", refused)
    await results.jobs.wait(failed.id, 60)
    assert (failed.result, failed.error) == (None, "There is nothing to compute")
    assert await results.get("refused", refused) is failed, "nobody tries again at once"
    monkeypatch.setattr("pftrack_server.jobs.jobs.LOOK_S", 0.001)
    left = await results.get("left alone", heavy)
    await results.jobs.wait(left.id, 60)
    again = (await results.get("left alone", heavy)).state
    assert (left.state, again) == ("failed", "working"), "the next visitor has not left it"
    results.jobs._kept_s = -1.0
    assert await results.get("refused", refused) is not failed
    await results.jobs.close()


def test_a_light_answer_does_not_wait_for_heavy_ones(tmp_path: Path, monkeypatch: Any) -> None:
    """However many lessons take minutes; one that is refused says why, and one that was left alone begins anew."""
    monkeypatch.setattr("pftrack_server.teaching.lessons.MOMENT_S", 0.05)
    run(answer_beside(tmp_path / "kept", monkeypatch))
