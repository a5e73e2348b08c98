"""What an experiment says in YAML files is read once, and what is wrong in them is named with its file and line."""

import shutil
from pathlib import Path

import pytest

import pftrack.experiments
from pftrack.core.model.plot import ERROR, Plot, Reading
from pftrack.experiments import find
from pftrack.experiments.declared import read_quality, read_words

FOLDERS = Path(pftrack.experiments.__file__).parent
FISH = find("fish")


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A copy of the files of the fish, to be spoilt."""
    copy = tmp_path / "fish"
    copy.mkdir()
    for path in (FOLDERS / "fish").iterdir():
        if path.suffix in {".yaml", ".json"}:
            shutil.copy(path, copy)
    return copy


def spoil(folder: Path, name: str, old: str, new: str) -> None:
    path = folder / name
    text = path.read_text("utf-8")
    assert old in text
    path.write_text(text.replace(old, new, 1), "utf-8")


def test_a_name_alone_is_the_standard_plot_and_reading(folder: Path) -> None:
    """Others have their fields, and all keep the order of the file."""
    words = read_words(folder, FISH.trackers)
    assert [plot.id for plot in words["plots"]][:2] == ["error", "bend"]
    assert words["plots"][0] is ERROR
    assert isinstance(words["plots"][1], Plot)
    assert Reading("bend", "value", "°", "bend", "bend_sd") in words["readings"]
    assert words["plots"] == FISH.plots


def test_whole_numbers_of_a_scene_stay_whole(folder: Path) -> None:
    """A range of whole numbers draws whole numbers, one of others any."""
    scenes = read_quality(folder, FISH.trackers).loss_probability.scenes
    assert scenes is not None
    drawn = scenes.draw(0)
    assert isinstance(drawn["tank_number"], int)
    assert isinstance(drawn["occlusion_width_px"], float)


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("title: Fish", "titel: Fish", r"fish/experiment.yaml, line 1: fish/experiment.yaml has an unknown field"),
        ("title: Fish that bends\n", "", r"fish/experiment.yaml: fish/experiment.yaml lacks 'title'"),
        ("title: bend of the tail", "titel: bend", r"line 39: plots.bend has an unknown field 'titel'"),
        ("    kind: band\n", "", r"experiment.yaml, line 38: plots.bend lacks 'kind'"),
        ("kind: band", "kind: bend", r"experiment.yaml, line 40: plots.bend has a wrong 'kind'"),
        ("mitsugami2009", "mitsugami1809", r"experiment.yaml, line 4: unknown reference 'mitsugami1809'"),
        ("trials: 4", "trials: some", r"example_sweep has a wrong 'trials'"),
        ("  ordinary:", "  unusual:", r"fish/experiment.yaml: it has titles of the trackers guided, unusual, "),
        ("title: Ordinary filter", "titel: Ordinary filter", r"trackers.ordinary has an unknown field 'titel'"),
        ("  body:\n", "  body:\n    length: 4\n", r"reported.body has an unknown field 'length'"),
    ],
)
def test_a_mistake_in_the_words_is_named_with_its_line(folder: Path, old: str, new: str, message: str) -> None:
    """A mistake of a person who mends a sentence is a sentence, not a traceback."""
    spoil(folder, "experiment.yaml", old, new)
    with pytest.raises(ValueError, match=message):
        read_words(folder, FISH.trackers)


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("presets:", "preset:", r"quality.yaml, line \d+: calibration has an unknown field 'preset'"),
        ("underconfident", "unsure", r"quality.yaml, line \d+: calibration.faults has a wrong '0.direction'"),
        ("fitted: 80", "fitted: many", r"quality.yaml, line \d+: scenes has a wrong 'fitted'"),
    ],
)
def test_a_mistake_in_the_quality_is_named_with_its_line(folder: Path, old: str, new: str, message: str) -> None:
    """So is one in what is said of bands and scenes."""
    spoil(folder, "quality.yaml", old, new)
    with pytest.raises(ValueError, match=message):
        read_quality(folder, FISH.trackers)
