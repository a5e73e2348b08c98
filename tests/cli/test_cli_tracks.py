"""Tables of tracks on the command line."""

import json
from pathlib import Path

import pytest

from tests.cli.commands import Call, refused
from tests.tracks import table


@pytest.fixture(scope="module")
def tracks(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A table of the first frames of the simulated prism."""
    path = tmp_path_factory.mktemp("tracks") / "prism.csv"
    path.write_text(table())
    return path


def test_a_table_is_followed_and_replayed(call: Call, tracks: Path, tmp_path: Path) -> None:
    """A run on a table is saved with its hash, and comes to the same numbers again; no mark is needed."""
    saved = tmp_path / "run.pft"
    code, out, _ = call("run", "structure", "--tracks", tracks, "--out", saved, "--json")
    assert code == 0
    report = json.loads(out)
    assert report["frames"] == 26
    again = call("replay", saved, "--video", tracks, "--json")
    assert json.loads(again[1])["estimates_sha256"] == report["estimates_sha256"]


def test_what_does_not_go_together_is_refused(call: Call, tracks: Path, tmp_path: Path) -> None:
    """A table where pictures are wanted, pictures' options where there are tracks, and a table with other columns."""
    wrong = tmp_path / "wrong.csv"
    wrong.write_text("frame,point,left,top\n0,1,2,3\n")
    box = ("--box", "1,1,9,9")
    refused(call("run", "ball", "--video", tracks, *box), 2, "footage must be pictures")
    refused(call("run", "structure", "--tracks", tracks, *box), 2, "takes no mark of kind 'box'")
    refused(call("run", "structure", "--tracks", tracks, "--truth", tracks), 2, "takes no --truth")
    refused(call("run", "structure", "--tracks", wrong), 1, "wrong.csv: the table has the columns frame, point, left,")
