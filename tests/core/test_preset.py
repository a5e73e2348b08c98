"""Presets are read from YAML, and what is wrong in them is named with its file and line."""

from dataclasses import replace
from pathlib import Path

import pytest

from pftrack.core.model.preset import Preset, Tour, read_failures, read_presets
from pftrack.experiments import find

TEXT = """
first:
  title: works
  tracker: h-spf
  parameters: {sample_count: 40}
  about: [gamma_px]
second:
  title: breaks
  tracker: apf
  seed: 3
  tour: {begin: See., reason: Because., plot: ess, frame: 16}
"""


def written(folder: Path, text: str) -> Path:
    path = folder / "presets.yaml"
    path.write_text(text, encoding="utf-8")
    return path


def test_presets_are_read_in_their_order(tmp_path: Path) -> None:
    """Lists become tuples, what is left out has its default, and each preset knows its line."""
    first, second = read_presets(written(tmp_path, TEXT))
    assert first == Preset("first", "works", "h-spf", {"sample_count": 40}, about=("gamma_px",))
    assert second == Preset("second", "breaks", "apf", seed=3, tour=Tour("See.", "Because.", "ess", 16))
    assert second.origin.endswith("presets.yaml, line 7")


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        (
            "title: works",
            "titel: works",
            r"presets.yaml, line 3: first has an unknown field 'titel'",
        ),
        ("  tracker: apf\n", "", r"presets.yaml, line 7: second lacks 'tracker'"),
        ("[gamma_px]", "[gamma_px", r"presets.yaml is not YAML"),
    ],
)
def test_what_is_wrong_is_named_with_its_line(tmp_path: Path, old: str, new: str, message: str) -> None:
    """A mistake of a person who mends a sentence is a sentence, not a traceback."""
    assert old in TEXT
    with pytest.raises(ValueError, match=message):
        read_presets(written(tmp_path, TEXT.replace(old, new)))


FAILURE = """
a: {title: A, kind: weights, diagnosis: D., tracker: apf, frame: 3, cause: unclear, cure: {text: It., values: {n: 1}},
    timeline: [{frame: 3, values: {}}]}
"""


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        (", values: {n: 1}", "", "line 2: a.cure lacks 'values'"),
        ("{frame: 3, v", "{frame: 3, frames: 3, v", "line 3: a.timeline has an unknown field '0.frames'"),
    ],
)
def test_what_is_wrong_with_a_failure_is_named_with_its_line(tmp_path: Path, old: str, new: str, message: str) -> None:
    """Failures are read in the same way, with their cures and changes; a value of the wrong kind is refused, too."""
    assert read_failures(written(tmp_path, FAILURE))[0].cure.values == {"n": 1}
    with pytest.raises(ValueError, match=message):
        read_failures(written(tmp_path, FAILURE.replace(old, new)))


@pytest.mark.parametrize(
    ("changed", "message"),
    [
        ({"tracker": "apx"}, "unknown tracker 'apx'"),
        ({"parameters": {"gamma": 1}}, "unknown parameter 'gamma'"),
        ({"about": ("gamma",)}, "unknown parameter 'gamma'"),
        ({"tour": Tour("", "", "esss", 3)}, "unknown plot 'esss'"),
    ],
)
def test_a_preset_names_what_the_experiment_has(changed: dict[str, object], message: str) -> None:
    """An experiment refuses a preset of a tracker, parameter or plot that it lacks, and names the file and line."""
    ball = find("ball")
    wrong = replace(ball.presets[0], **changed)
    with pytest.raises(ValueError, match=rf"ball/presets.yaml, line 1: works names an {message}"):
        replace(ball, presets=(wrong, *ball.presets[1:])).check_starts()
