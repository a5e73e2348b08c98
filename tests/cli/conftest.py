"""Fixtures of the command line: calls in this process, and a small clip."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from pftrack.cli.app import main
from pftrack.vision.film import FilmWriter
from tests.cli.commands import FRAMES, Ask, Call
from tests.pooling import fork_server, shared_fork_server

__all__ = ["fork_server", "shared_fork_server"]


@pytest.fixture
def call(capfd: pytest.CaptureFixture[str]) -> Call:
    """Run the command line in this process; return status, standard output and standard error."""

    def run(*arguments: object) -> tuple[int, str, str]:
        with pytest.raises(SystemExit) as ended:
            main([str(argument) for argument in arguments])
        out, err = capfd.readouterr()
        assert isinstance(ended.value.code, int)
        return ended.value.code, out, err

    return run


@pytest.fixture
def ask(call: Call) -> Ask:
    """Run the command line with `--json`, check that it succeeds, and return the value."""

    def run(*arguments: object) -> Any:
        status, out, err = call(*arguments, "--json")
        assert status == 0, err
        return json.loads(out)

    return run


@pytest.fixture(scope="session")
def clip(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a film of a red square that moves two pixels per frame, next to its table of boxes."""
    folder = tmp_path_factory.mktemp("clip")
    boxes = [(20 + 2 * frame, 30, 10, 8) for frame in range(FRAMES)]
    with FilmWriter(folder / "clip.mp4", 25.0) as film:
        for x, y, w, h in boxes:
            picture = np.full((80, 120, 3), 100, np.uint8)
            picture[y : y + h, x : x + w] = (200, 40, 40)
            film.write(picture)
    rows = (f"{frame},{x},{y},{w},{h},\n" for frame, (x, y, w, h) in enumerate(boxes))
    (folder / "truth.csv").write_text("frame,x,y,w,h,state\n" + "".join(rows))
    return folder / "clip.mp4"
