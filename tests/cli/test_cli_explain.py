"""The command line's explanation of a loss."""

import json
from pathlib import Path

import pftrack
from tests.cli.commands import Ask, Call, refused


def test_a_saved_run_is_explained_by_command_as_in_python(call: Call, ask: Ask, tmp_path: Path) -> None:
    """`pftrack explain` prints what `run.explain()` says, and `--json` all of it; a frame may be asked for."""
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


def test_the_command_says_what_would_have_saved_it(call: Call, tmp_path: Path) -> None:
    """After the diagnosis come what was tried, the unchanged settings first, and what that does not say."""
    run, file = pftrack.run("ball", preset="too-wide", frames=45), tmp_path / "lost.pft"
    run.save(file)
    explained = run.explain(seeds=2)
    page = tmp_path / "lost.html"
    code, out, _ = call("explain", str(file), "--seeds", "2", "--html", str(page))
    lines = out.splitlines()
    assert (code, lines[0]) == (0, explained.diagnosis.sentence)
    assert lines[-1] == "A cure of this run is not a cure in general: a sweep over seeds and scenes says that."
    begin = next(place for place, line in enumerate(lines) if line == "Too few seeds to tell.")
    unchanged = "Same settings, other seeds: 0 of 2 hold to frame 37, 0 of 2 to the end (0% to 66%)"
    assert lines[begin + 1].startswith(unchanged)
    better = "Occluder width 100 px to 50 px: 2 of 2 hold to frame 37, 2 of 2 to the end (34% to 100%), "
    assert any(line.startswith(better) and line.endswith("too few seeds to tell.") for line in lines[begin:])
    assert "Occluder width 100 px to 50 px" in explained._repr_html_()
    told = page.read_text(encoding="utf-8")
    expected = ("Why it was lost", "Occluder width 100 px to 50 px", explained.what_if.sentence)
    assert [words for words in expected if words not in told] == []
    refused(call("explain", str(file), "--html", str(tmp_path / "lost.csv")), 2, "must name a file that ends in .html")
    assert pftrack.run("ball", preset="works", frames=5).explain(seeds=2).what_if is None
