"""The registry accepts usable experiments, and reads their YAML files; mistakes are reported."""

import json
import shutil
from pathlib import Path

import pytest

import pftrack.experiments
from pftrack.core.model.series import ERROR, Reading
from pftrack.core.refusal import RefusedError
from pftrack.experiments import EXPERIMENTS, find
from pftrack.experiments.declared import ERRORS, read_words
from pftrack.experiments.experiment import INTERFACE
from pftrack.experiments.linkage import experiment as linkage
from pftrack.experiments.structure import experiment as structure
from tests.installing import commands, install, python
from tools.loss_study import draw_scene

GOOD = f"""
from dataclasses import replace
from pftrack.experiments import find
EXPERIMENT = replace(find("sine"), id="own", title="A signal of my own", interface={INTERFACE})
"""

BROKEN = {
    "no-import": ("import surely_not_installed", "importing it raises ModuleNotFoundError"),
    "raises": ("raise ValueError('at import')", "importing it raises ValueError"),
    "ends": ("raise SystemExit(3)", "importing it raises SystemExit"),
    "other-type": ("EXPERIMENT = 7", "must be a pftrack.experiments.experiment.Experiment, got int"),
    "no-attribute": ("OTHER = 7", "importing it raises AttributeError"),
    "no-version": (GOOD.replace(f"interface={INTERFACE}", "interface=0"), "it states no version of the interface"),
    "late": (GOOD.replace(f"interface={INTERFACE}", "interface=99"), "it states version 99 of the interface"),
    "other-id": (GOOD, "its id 'own' differs from the name of its entry point"),
    "ball": (GOOD.replace('"own"', '"ball"'), "its name is taken by pftrack itself"),
    "Up/../and": (GOOD, "its name must be at most 64 lower-case letters"),
}


@pytest.fixture(scope="module")
def place(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a folder with a good package, one of the same name, and one broken in each way."""
    place = tmp_path_factory.mktemp("installed")
    for name in ("a-good-one", "a-second-one"):
        install(place, name, GOOD, f"own = {name.replace('-', '_')}:EXPERIMENT")
    for number, (name, (source, _)) in enumerate(BROKEN.items()):
        install(place, f"broken-{number}", source, f"{name} = broken_{number}:EXPERIMENT")
    return place


def said(place: Path, program: str, *arguments: str) -> str:
    """Return the output of a program beside the packages of a folder."""
    done = python(place, "-c", program, *arguments)
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_usable_packages_are_registered_and_others_reported(place: Path) -> None:
    """The good experiment follows the project's own; each other is left out with the reason.

    Listing names imports no experiment of the project, and finding one imports no other.
    """
    program = (
        "import json, sys; from pftrack.experiments import EXPERIMENTS, find\n"
        "def imported(): return [n for n in sys.modules if n.endswith('.experiment') and n.count('.') > 2"
        " or n.startswith(('a_', 'broken_'))]\n"
        "assert (next(iter(EXPERIMENTS)), imported()) == ('ball', [])\n"
        "assert find('sine') is EXPERIMENTS['sine'] is find('sine')\n"
        "assert imported() == ['pftrack.experiments.sine.experiment'], imported()\n"
        "print(json.dumps([list(EXPERIMENTS), EXPERIMENTS['own'].title, len(EXPERIMENTS),"
        " {p.package: p.problem for p in EXPERIMENTS.plugins}]))"
    )
    names, title, count, problems = json.loads(said(place, program))
    assert names == [*EXPERIMENTS.own, "own"]
    assert (title, count) == ("A signal of my own", len(EXPERIMENTS.own) + 1)
    assert problems.pop("a-good-one 1.0") == ""
    taken = "The experiment own of a-second-one 1.0 cannot be used: its name is taken by a-good-one 1.0."
    assert problems.pop("a-second-one 1.0") == taken
    for number, (name, (_, reason)) in enumerate(BROKEN.items()):
        sentence = problems.pop(f"broken-{number} 1.0")
        assert sentence.startswith(f"The experiment {name} of broken-{number} 1.0 cannot be used: ")
        assert reason in sentence
    assert problems == {}


def test_commands_work_beside_broken_packages(place: Path) -> None:
    """`list` reports them, and naming a broken one gives the reason in one line."""
    listed, refused = commands(place, ["list", "--json"], ["show", "no-import"])
    assert [entry["id"] for entry in json.loads(listed.out)] == [*EXPERIMENTS.own, "own"]
    assert "The experiment late of broken-6 1.0 cannot be used" in listed.err
    assert refused.status == 2
    assert refused.err == (
        "pftrack: the experiment no-import of broken-0 1.0 cannot be used: importing it raises ModuleNotFoundError: "
        "No module named 'surely_not_installed'\n"
    )


DOCTORS = """
import os, sys
from pftrack.doctor.checks import _experiments
import pftrack.experiments.sine.experiment, pftrack.doctor.compiling
for place in sys.argv[1:]:
    if not os.fork():
        sys.path.append(place)
        print(*_experiments(everything=False), flush=True)
        os._exit(0)
    os.wait()
"""
"""Prints the doctor's line on experiments beside the packages of each folder."""


def test_the_doctor_reports_what_is_broken(place: Path, tmp_path: Path) -> None:
    """A package that is broken or does not run gives a warning; without one the good package is named."""
    places = [place, tmp_path / "good", tmp_path / "failing"]
    failing = GOOD.replace('id="own"', 'id="failing", simulate=lambda: 1 / 0')
    for folder in places[1:]:
        folder.mkdir()
        install(folder, "a-good-one", GOOD, "own = a_good_one:EXPERIMENT")
    install(places[2], "a-failing-one", failing, "failing = a_failing_one:EXPERIMENT")
    broken, good, failed = said(tmp_path, DOCTORS, *map(str, places)).splitlines()
    assert broken.startswith("warning The experiment Up/../and of broken-9")
    assert "importing it raises ModuleNotFoundError: No module named 'surely_not_installed'" in broken
    assert good == f"ok {len(EXPERIMENTS.own)} of pftrack, and own of a-good-one 1.0"
    assert failed.startswith("warning The experiment failing of a-failing-one 1.0 does not run: ZeroDivisionError")


def test_the_registry_is_a_mapping() -> None:
    """An unknown name is not a member, and is refused with the known names."""
    assert EXPERIMENTS.get("nothing") is None
    assert all(experiment.id == name for name, experiment in EXPERIMENTS.items())
    with pytest.raises(RefusedError, match=r"experiment must be one of ball, histogram, fish, .*, got 'nothing'"):
        find("nothing")


# The YAML files of an experiment: mistakes are reported with file and line.

FISH = find("fish")


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """Return a copy of the files of the fish."""
    own = Path(pftrack.experiments.__file__).parent / "fish"
    return Path(shutil.copytree(own, tmp_path / "fish", ignore=shutil.ignore_patterns("*.py", "__pycache__")))


def test_words_are_read_from_files(folder: Path) -> None:
    """A name alone is the standard plot; readings have their fields; ranges of integers stay integers."""
    words = read_words(folder, FISH.trackers)
    assert words["display"].plots == FISH.display.plots
    assert words["display"].plots[0] is ERROR
    assert Reading("bend", "value", "°", "bend", "bend_sd") in words["display"].readings
    drawn = draw_scene(words["quality"].loss_probability.scenes, 0)
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
        ("underconfident", "unsure", r"quality.yaml, line \d+: calibration.tested has a wrong '0.found'"),
    ],
)
def test_a_mistake_is_reported_with_its_line(folder: Path, old: str, new: str, message: str) -> None:
    """A mistake in a sentence or a number gives a sentence, not a traceback."""
    for path in (folder / "experiment.yaml", folder / "quality.yaml"):
        path.write_text(path.read_text("utf-8").replace(old, new, 1), "utf-8")
    with pytest.raises(ValueError, match=message):
        read_words(folder, FISH.trackers)


def test_measures_are_read_from_files(folder: Path) -> None:
    """They are measures of the errors by default; values of an undeclared measure are refused."""
    known, own = find("structure"), Path(pftrack.experiments.__file__).parent / "structure"
    measure = known.measured.measures[-1]
    assert read_words(own, known.trackers)["measured"].measures[-1] == measure
    assert measure.frames is ERRORS
    with pytest.raises(ValueError, match=r"fish/experiment\.yaml: it lacks the measures beauty"):
        read_words(folder, FISH.trackers, frames={"beauty": ERRORS})


def test_numbers_in_the_words_of_measures_are_those_of_the_code() -> None:
    """The files repeat numbers of the code."""
    last = find("linkage").measure_named("final_direction_error_deg")
    for text in (last.title, last.description):
        assert f"last {linkage.LAST_FRAMES} " in text
    for name in (structure.WITHIN, "frames_to_shape"):
        assert f"at most {structure.FOUND_PERCENT:g} %" in find("structure").measure_named(name).description
