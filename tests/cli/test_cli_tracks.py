"""Tables of tracks on the command line."""

from pathlib import Path

import numpy as np
import pytest

from pftrack.sources.tracks import write
from tests.arm import FRAMES, joints
from tests.cli.commands import Ask, Call, refused
from tests.tracks import table


@pytest.fixture(scope="module")
def tracks(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a table of the first frames of the simulated prism."""
    path = tmp_path_factory.mktemp("tracks") / "prism.csv"
    path.write_text(table())
    return path


def test_a_table_is_followed_and_replayed(ask: Ask, tracks: Path, tmp_path: Path) -> None:
    """A saved run on a table gives the same numbers again; it needs no mark."""
    saved = tmp_path / "run.pft"
    report = ask("run", "structure", "--tracks", tracks, "--out", saved)
    assert report["frames"] == 26
    assert ask("replay", saved, "--video", tracks)["estimates_sha256"] == report["estimates_sha256"]


def test_wrong_recordings_are_refused(call: Call, tracks: Path, tmp_path: Path) -> None:
    """So are a table for an experiment on pictures, options of pictures, and a table with other columns."""
    wrong = tmp_path / "wrong.csv"
    wrong.write_text("frame,point,left,top\n0,1,2,3\n")
    box = ("--box", "1,1,9,9")
    refused(call("run", "ball", "--video", tracks, *box), 2, "footage must be pictures")
    refused(call("run", "structure", "--tracks", tracks, *box), 2, "takes no mark of kind 'box'")
    refused(call("run", "structure", "--tracks", tracks, "--truth", tracks), 2, "takes no --truth")
    refused(call("run", "structure", "--tracks", wrong), 1, "wrong.csv: the table has the columns frame, point, left,")


def test_a_table_of_just_the_points_needs_no_mark(call: Call, ask: Ask, tmp_path: Path) -> None:
    """Four tracks are a chain in their order; five are refused, with the option by name."""
    four = 2.0 * np.array([joints(index) for index in range(FRAMES)]) + np.array([80.0, 20.0])
    for names, points in (("abcd", four), ("abcde", np.concatenate([four, four[:, :1] + 30.0], axis=1))):
        (tmp_path / f"{names}.csv").write_text(write(list(names), points, np.ones_like(points)))
    chain = ("run", "linkage", "--tracks")
    assert ask(*chain, tmp_path / "abcd.csv", "--frames", "3")["frames"] == 3
    refused(call(*chain, tmp_path / "abcde.csv"), 2, "footage must be tracks of 4 points", "got 5")
    refused(call("run", "ball", "--tracks", tmp_path / "abcd.csv"), 2, "--tracks needs --mark box:x,y,w,h")
    refused(call(*chain, tmp_path / "abcd.csv", "--video", "abcd.csv"), 2, "give either --video or --tracks, not both")
