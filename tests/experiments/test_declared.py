"""What an experiment says in YAML files is read once, and what is wrong in them is named with its file and line."""

import shutil
from pathlib import Path

import pytest

import pftrack.experiments
from pftrack.core.model.series import ERROR, Reading
from pftrack.experiments import find
from pftrack.experiments.declared import ERRORS, read_words
from pftrack.experiments.linkage import experiment as linkage
from pftrack.experiments.structure import experiment as structure

FISH = find("fish")


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A copy of the files of the fish, to be spoilt."""
    own = Path(pftrack.experiments.__file__).parent / "fish"
    return Path(shutil.copytree(own, tmp_path / "fish", ignore=shutil.ignore_patterns("*.py", "__pycache__")))


def test_a_name_alone_is_the_standard_plot_and_reading(folder: Path) -> None:
    """Others have their fields, and all keep the order of the file."""
    words = read_words(folder, FISH.trackers)
    assert words["display"].plots == FISH.display.plots
    assert words["display"].plots[0] is ERROR
    assert Reading("bend", "value", "°", "bend", "bend_sd") in words["display"].readings


def test_whole_numbers_of_a_scene_stay_whole(folder: Path) -> None:
    """A range of whole numbers draws whole numbers, one of others any."""
    scenes = read_words(folder, FISH.trackers)["quality"].loss_probability.scenes
    assert scenes is not None
    drawn = scenes.draw(0)
    assert (type(drawn["tank_number"]), type(drawn["occlusion_width_px"])) == (int, float)


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("title: Fish", "titel: Fish", r"experiment.yaml, line 1: fish/experiment.yaml has an unknown field 'titel'"),
        ("title: Fish that bends\n", "", r"fish/experiment.yaml: fish/experiment.yaml lacks 'title'"),
        ("title: bend of the tail", "titel: bend", r"line 42: plots.bend has an unknown field 'titel'"),
        ("mitsugami2009", "mitsugami1809", r"experiment.yaml, line 4: unknown reference 'mitsugami1809'"),
        ("  ordinary:", "  unusual:", r"fish/experiment.yaml: it has titles of the trackers guided, unusual, "),
        ("  body:\n", "  body:\n    length: 4\n", r"reported.body has an unknown field 'length'"),
        ("underconfident", "unsure", r"quality.yaml, line \d+: calibration.faults has a wrong '0.direction'"),
    ],
)
def test_a_mistake_is_named_with_its_line(folder: Path, old: str, new: str, message: str) -> None:
    """A mistake of a person who mends a sentence or a number is a sentence, not a traceback."""
    for path in (folder / "experiment.yaml", folder / "quality.yaml"):
        path.write_text(path.read_text("utf-8").replace(old, new, 1), "utf-8")
    with pytest.raises(ValueError, match=message):
        read_words(folder, FISH.trackers)


def test_measures_of_a_file_are_of_the_errors_by_default(tmp_path: Path) -> None:
    """A mistake in one is named with its line, as in other sections."""
    known, own = find("structure"), Path(pftrack.experiments.__file__).parent / "structure"
    assert read_words(own, known.trackers)["measured"].measures[-1] == known.measured.measures[-1]
    assert known.measured.measures[-1].frames is ERRORS
    text = (own / "experiment.yaml").read_text("utf-8").replace("how: until", "hou: until")
    (tmp_path / "experiment.yaml").write_text(text, "utf-8")
    with pytest.raises(ValueError, match=r"line \d+: measures.frames_to_shape has an unknown field 'hou'"):
        read_words(tmp_path, known.trackers)


def test_values_of_a_measure_that_no_file_declares_are_refused(folder: Path) -> None:
    """So a misspelt name does not leave the measure with the errors."""
    with pytest.raises(ValueError, match=r"fish/experiment\.yaml: it lacks the measures beauty"):
        read_words(folder, FISH.trackers, frames={"beauty": ERRORS})


def test_numbers_in_the_words_of_measures_are_those_of_the_code() -> None:
    """Files repeat them."""
    last = find("linkage").measure_named("final_direction_error_deg")
    assert f"last {linkage.LAST_FRAMES} " in last.title
    assert f"last {linkage.LAST_FRAMES} " in last.description
    for name in (structure.WITHIN, "frames_to_shape"):
        assert f"at most {structure.FOUND_PERCENT:g} %" in find("structure").measure_named(name).description
