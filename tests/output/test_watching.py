"""Watching a loop that is being recorded: the scene follows it, and the loop waits for nothing."""

import threading
from pathlib import Path
from types import SimpleNamespace

import pytest

import pftrack
from pftrack.output.exports import formats
from pftrack.runs.run import Run


class Scene:
    """Stands for a scene: it keeps the runs that it is to show."""

    def __init__(self) -> None:
        self.runs: list[Run] = []
        self.news = threading.Condition()

    def show(self, run: Run, **_: object) -> SimpleNamespace:
        self.follow(run)
        return SimpleNamespace(follow=self.follow)

    def follow(self, run: Run) -> None:
        with self.news:
            self.runs.append(run)
            self.news.notify()

    def wait_for(self, frames: int) -> None:
        with self.news:
            assert self.news.wait_for(lambda: self.runs and self.runs[-1].frames == frames, 30)


def test_the_scene_follows_the_loop(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Each frame that was written is shown before the loop has ended, at the newest one, and the last one after it."""
    scene = Scene()
    monkeypatch.setattr(formats, "show", scene.show)
    with pftrack.record(tmp_path / "mine.pft", watch=True) as rec:
        for t in range(3):
            rec(t, mean=[float(t), 1.0])
            rec._hand_on()
            scene.wait_for(t + 1)
        rec(3, mean=[3.0, 1.0])
    assert scene.runs[-1].frames == 4
    assert scene.runs[-1].current.diagnostics.estimate == (3.0, 1.0)
