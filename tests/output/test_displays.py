"""Displays of runs and comparisons in notebooks, and the names in `pftrack` itself."""

import math
import re
import subprocess
import sys
from pathlib import Path
from typing import Any
from xml.etree import ElementTree as ET

import pytest

import pftrack
from pftrack.core.refusal import ParameterError, RefusedError
from pftrack.output.displays import MISSING, quantity, run_html, summary_lines, track
from tests.making import disc_film

WIDE = {"occlusion_width_px": 70.0}


@pytest.fixture(scope="module")
def run() -> pftrack.Run:
    return pftrack.run("ball", frames=60, seed=3, **WIDE)


def parsed(html: str) -> tuple[list[str], list[str]]:
    """Return the texts of a display and the sources of its pictures; every tag but that of a picture is closed."""
    whole = ET.fromstring(re.sub(r"(<img [^>]*[^/])>", r"\1/>", f"<div>{html}</div>"))  # noqa: S314 - made here
    return list(whole.itertext()), [picture.attrib["src"] for picture in whole.iter("img")]


def test_a_run_shows_its_frame_and_its_summary(run: pftrack.Run) -> None:
    """The summary's figures are next to the picture, with units and the hash."""
    words, pictures = parsed(run._repr_html_())
    summary = run.summary()
    assert f"{summary.verdict.mean_error:.1f} px" in words
    assert "all 60 frames" in words
    assert any(word.startswith(summary.estimates_sha256[:16]) for word in words)
    assert pictures[0].startswith("data:image/jpeg;base64,")
    assert "60 of 60 frames computed, at frame 59" in repr(run)


def test_a_track_has_a_point_for_each_error_and_a_band_for_each_loss(run: pftrack.Run) -> None:
    """It is SVG with one line through all errors, and a band for each hidden or lost stretch."""
    drawn = ET.fromstring(track(run))  # noqa: S314 - made here
    path = next(part for part in drawn if part.tag == "path")
    assert len(path.get("d").split()) == 60
    stretches = 0
    for flags in ([row.hidden is True for row in run.diagnostics], [row.is_lost for row in run.diagnostics]):
        stretches += sum(flag and not before for before, flag in zip([False, *flags], flags, strict=False))
    assert len([part for part in drawn if part.tag == "rect"]) == stretches > 0


def test_a_comparison_shows_differences(run: pftrack.Run) -> None:
    """It has trackers, errors and the paired difference with its interval."""
    other = pftrack.run("ball", tracker="condensation", frames=60, seed=3, **WIDE)
    comparison = pftrack.compare(run, other)
    words = " ".join(parsed(comparison._repr_html_())[0])
    assert f"They differ from frame {comparison.first_difference} on." in words
    assert f"{comparison.outcomes[1].mean_error:.1f}" in words
    with pytest.raises(RefusedError, match="two to four runs"):
        pftrack.compare(run)
    error = comparison.paired[0]
    assert f"{error.mean:+.2f} px (95 % interval {error.low:+.2f} to {error.high:+.2f}) over 60 frames" in words
    assert f"{100 * comparison.paired[1].mean:+.2f} points" in words


def test_a_run_is_made_saved_and_loaded_again(run: pftrack.Run, tmp_path: Path) -> None:
    """A loaded run has the same estimates; values may override a preset."""
    run.save(tmp_path / "run.pft")
    again = pftrack.load(tmp_path / "run.pft")
    assert again.estimates_sha256 == run.estimates_sha256
    run.export(tmp_path / "run.json")
    assert pftrack.load(tmp_path / "run.json").estimates_sha256 == run.estimates_sha256
    few = pftrack.run("ball", preset="few", frames=3, seed=9, sample_count=77)
    assert (few.seed, few.parameters_at(0).sample_count) == (9, 77)


def test_a_file_that_is_not_a_recipe_is_refused(tmp_path: Path) -> None:
    """The sentence names the file."""
    file = tmp_path / "broken.json"
    with pytest.raises(RefusedError, match=r"the file .* does not exist"):
        pftrack.load(file)
    file.write_text("{")
    with pytest.raises(RefusedError, match=r"broken\.json is not JSON"):
        pftrack.load(file)


@pytest.mark.parametrize(
    ("given", "sentence"),
    [
        ({"experiment": "bal"}, r"experiment must be one of ball, .*, got 'bal'"),
        ({"preset": "best"}, "the preset of ball must be one of works"),
        ({"recording": "/none.mp4"}, "which does not exist; give its path as `recording`"),
        ({"mark": {"kind": "box"}}, "belong to a recording"),
    ],
)
def test_an_impossible_run_is_refused(given: dict[str, Any], sentence: str) -> None:
    """The sentence names what is unknown, and the known ones."""
    with pytest.raises((RefusedError, ParameterError), match=sentence):
        pftrack.run(**{"experiment": "ball", **given})


def test_a_run_is_begun_from_a_box_and_measured_by_a_truth(tmp_path: Path) -> None:
    """With `finish=False` it stays at its first frame; a truth of other frames is refused."""
    clip = tmp_path / "clip.mp4"
    clip.write_bytes(disc_film(12))
    given = {"recording": clip, "box": (36, 56, 9, 9), "seed": 2}
    truth = dict.fromkeys(range(2, 9), (36, 56, 9, 9))
    begun = pftrack.run("ball", **given, truth=truth, finish=False)
    assert (begun.computed, begun.frames, begun.setup.footage.start) == (0, 10, 2)
    (tmp_path / "gt.csv").write_text("frame,x,y,w,h\n" + "".join(f"{frame},36,56,9,9\n" for frame in truth))
    done = pftrack.run("ball", **given, truth=tmp_path / "gt.csv")
    assert done.summary().verdict.labelled_frames == 7
    assert done.recipe.footage.truth == truth
    with pytest.raises(RefusedError, match="expected a truth of frames 0 to 11"):
        pftrack.run("ball", **given, start=0, truth={40: (1, 2, 3, 4)})
    with pytest.raises(ParameterError, match="the only mark"):
        pftrack.run("ball", **given, mark={"kind": "box"})


def test_importing_the_library_loads_nothing() -> None:
    """`import pftrack` loads no NumPy, though all of its names and modules are available."""
    program = "import sys, pftrack; assert 'numpy' not in sys.modules; assert {'run', 'sweep'} < set(dir(pftrack)); "
    program += "pftrack.Recipe; assert pftrack.sources.__doc__; pftrack.nothing"
    done = subprocess.run([sys.executable, "-c", program], check=False, capture_output=True, text=True)
    assert "module 'pftrack' has no attribute 'nothing'" in done.stderr
    assert set(pftrack.__all__) < set(dir(pftrack))
    assert None not in [getattr(pftrack, name) for name in pftrack.__all__]


def test_trials_are_shown_after_an_explanation_with_seeds() -> None:
    """A lost run then shows what would have helped; its branches do not."""
    run = pftrack.run("ball", preset="too-wide", frames=20)
    assert run.explain().what_if is None
    assert (run.explained, "What if" in summary_lines(run)) == (None, False)
    found = run.explain(seeds=1)
    assert summary_lines(run)["What if"] == found.what_if.sentence
    assert found.what_if.sentence in run_html(run)
    twin = run.branch(17)
    assert twin.explained is None
    assert twin.explain(seeds=1) is twin.explained
    twin.seek(twin.computed)
    twin.change({"sample_count": 200})
    assert twin.explained is None  # later frames differ from those of the trials


@pytest.mark.parametrize(
    ("value", "unit", "words"),
    [(3.0, "", "3"), (-0.01, "px", "0.0"), (0.25, "", "0.250"), (7.6, "frames", "8"), (math.inf, "px", MISSING)],
)
def test_quantities_have_the_decimals_of_their_unit(value: float, unit: str, words: str) -> None:
    """Counts have no decimals, lengths one, shares three."""
    assert quantity(value, unit) == words
    assert quantity(None, unit) == MISSING
