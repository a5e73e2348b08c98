"""The command line's explanation of a loss."""

import json
from pathlib import Path

import pftrack
from tests.cli.commands import Ask, Call, refused


def test_a_saved_run_is_explained_by_command_as_in_python(call: Call, ask: Ask, tmp_path: Path) -> None:
    """`pftrack explain` prints the lines of `run.explain()`, and `--json` all of it; `--frame` chooses a frame."""
    values = {"occlusion_width_px": 0, "distracter_radius_px": 0, "process_noise_px": 0.1, "period_s": 2}
    run, file = pftrack.run("ball", tracker="kalman", frames=60, **values), tmp_path / "lost.pft"
    run.save(file)
    explained = run.explain()
    code, out, _ = call("explain", str(file), "--seeds", "0")
    assert (code, out.splitlines()) == (0, list(explained.lines))
    assert ask("explain", file, "--seeds", 0) == json.loads(json.dumps(explained.as_dict()))
    asked = ask("explain", file, "--frame", 30, "--seeds", 0)["diagnosis"]
    assert asked["cause"] == "shrinking-covariance"
    refused(call("explain", str(file), "--frame", "60"), 2, "--frame must be a whole number between 0 and 59")
    refused(call("explain", str(file), "--seeds", "-1"), 2, "--seeds must be a whole number between 0 and 1000")


def test_an_explanation_has_the_changes_that_would_have_helped(call: Call, tmp_path: Path) -> None:
    """After the diagnosis come the trials, with the unchanged settings first, and a caveat; a page has the same."""
    run, file = pftrack.run("ball", preset="too-wide", frames=45), tmp_path / "lost.pft"
    run.save(file)
    page = tmp_path / "lost.html"
    code, out, _ = call("explain", str(file), "--seeds", "1", "--html", str(page))
    lines = out.splitlines()
    assert (code, lines[0]) == (0, run.explain(seeds=0).diagnosis.sentence)
    sentence = "Too few seeds to tell."
    assert sentence in lines
    assert any(line.startswith("Occluder width 100 px to 50 px: 1 of 1 hold to frame 37, 1 of 1") for line in lines)
    assert lines[-1] == "A cure of this run is not a cure in general: a sweep over seeds and scenes says that."
    told = page.read_text(encoding="utf-8")
    expected = ("Why it was lost", "Occluder width 100 px to 50 px", sentence)
    assert [words for words in expected if words not in told] == []
    refused(call("explain", str(file), "--html", str(tmp_path / "lost.csv")), 2, "must name a file that ends in .html")
