"""Each check fails for an experiment that breaks what it is about, and says what is wrong."""

import math
import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from pftrack.core.model.band import BandTest, Calibration, Finding
from pftrack.core.model.drawing import Ellipsoids
from pftrack.core.model.parameters import parameter
from pftrack.core.model.preset import Preset
from pftrack.core.model.setup import Suitability
from pftrack.experiments import EXPERIMENTS, find
from pftrack.experiments.experiment import Experiment, Quality
from pftrack.experiments.sine.experiment import SineParameters
from pftrack.testing import Check, CheckError, check_experiment, experiment_checks
from tests.installing import environment, install
from tests.testing import broken
from tests.testing.broken import BALL, BROKEN, KALMAN, SOUND, SPACE, boasting, displaying, in_world, measuring


@pytest.fixture(autouse=True)
def _registered(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(EXPERIMENTS._known, "under-test", SOUND)


def checks_of(experiment: Experiment) -> dict[str, Check]:
    """Return the checks by name, those of a tracker for the first one."""
    checks: dict[str, Check] = {}
    for check in experiment_checks(experiment):
        checks.setdefault(str(check).partition(" (")[0], check)
    return checks


@pytest.mark.parametrize("name", BROKEN)
def test_each_check_can_fail(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """An experiment that is broken in one way fails the check of that, with a sentence."""
    make, sentence = BROKEN[name]
    experiment = make()
    if experiment.id in EXPERIMENTS:
        monkeypatch.setitem(EXPERIMENTS._known, experiment.id, experiment)
    with pytest.raises(CheckError, match=sentence):
        checks_of(experiment)[name]()


MEASURES = "its measures are declared whole"


@pytest.mark.parametrize(
    ("check", "experiment", "sentence"),
    [
        (
            "it says what it is",
            replace(SOUND, trackers={"Kalman 1/2": replace(KALMAN, id="Kalman 1/2")}),
            r"the name of a tracker must be .*, got 'Kalman 1/2'",
        ),
        (
            "its presets run",
            replace(SOUND, presets=(Preset("../works", "works", "kalman"),)),
            r"the name of a preset must be .*, got '\.\./works'",
        ),
        (MEASURES, measuring(name="sample_count"), "columns of a sweep .* unique names, got twice sample_count"),
        (MEASURES, measuring(name="seed"), "got twice seed"),
        (MEASURES, measuring(name="error"), "every sweep has error: a measure must have another name"),
        (MEASURES, measuring(name="../curves"), r"the name of a measure must be .*, got '\.\./curves'"),
    ],
)
def test_names_are_held_to_where_they_stand(check: str, experiment: Experiment, sentence: str) -> None:
    """Names become parts of addresses and files, and columns of a sweep, where two of one name would be one."""
    with pytest.raises(CheckError, match=sentence):
        checks_of(experiment)[check]()


@pytest.mark.parametrize(
    ("suits", "sentence"),
    [
        (
            broken.refusing,
            "must look how suitable a recording with a box is without an error, got ValueError: too dark",
        ),
        (lambda *_: 0.5, "must be a Suitability, got 0.5"),
        (lambda *_: Suitability(math.nan, "fine"), "must lie between 0 and 1, got nan"),
        (
            lambda *_: Suitability(0.5, "fine", likelihood=np.full((3, 4), math.nan)),
            r"must be \(height, width\) numbers from 0 to 1, got \(3, 4\)",
        ),
        (lambda *_: Suitability(0.5, "Fine."), r"must be clauses without full stops, got 'Fine\.'"),
    ],
)
def test_what_an_experiment_says_of_a_target_is_looked_at(suits: Any, sentence: str) -> None:
    """Where it can tell how suitable a target is, it does so without an error, by a number from 0 to 1 and clauses."""
    with pytest.raises(CheckError, match=sentence):
        checks_of(replace(BALL, video=replace(BALL.video, suits=suits)))["a film of its scene is tracked from a mark"]()


class Formula(SineParameters, group="Signal"):
    """A description as one would type it for a printer of formulas."""

    observation_noise_sd: float = parameter(
        0.1, "Observation noise", "Noise sigma_z on what is seen.", within=(0.05, 0.5, 0.05)
    )


class Silent(SineParameters, group="Signal"):
    """A field that is declared anew without a docstring below it."""

    observation_noise_sd: float = parameter(0.1, "Observation noise", within=(0.05, 0.5, 0.05))


@pytest.mark.parametrize(
    ("model", "sentence"),
    [
        (Formula, r"the help of observation_noise_sd must be in words, .*sigma_z"),
        (Silent, "observation_noise_sd, the docstring below it, must be a sentence"),
    ],
)
def test_help_that_a_page_cannot_show_is_found(model: type[SineParameters], sentence: str) -> None:
    """Titles and descriptions are shown as they are, so a subscript has to be said in words, and none is missing."""
    with pytest.raises(CheckError, match=sentence):
        checks_of(broken.declaring(model))["its parameters are declared whole"]()


def test_a_batch_that_keeps_less_than_a_live_run_is_found() -> None:
    """What a sweep keeps of a tracker's series is compared too: a fold may leave one out."""
    with pytest.raises(CheckError, match=r"another observation_share than a live run .*: None for 0"):
        checks_of(broken.folding(lambda _: {"series": {}}))["a batch gives the numbers of live runs"]()


def bodies(covariance: Any) -> Ellipsoids:
    spread = np.array([covariance], np.float32)
    return Ellipsoids(np.zeros((1, 3), np.float32), spread, np.zeros((1, 3), np.uint8), 0.5, "estimate")


@pytest.mark.parametrize(
    ("experiment", "sentence"),
    [
        (displaying(in_world(), worlds=()), "must have the worlds that are declared, none, got space"),
        (in_world(world=replace(SPACE, radius=6.0)), "must have the worlds that are declared, space, got space"),
        (
            displaying(in_world(), worlds=(replace(SPACE, unit=""),)),
            "the world 'space' must have a name, a title and a unit",
        ),
        (in_world(bodies(np.diag([1, np.nan, 1]))), "covariances of it in frame 0 must be finite"),
        (in_world(bodies(np.diag([1, -1, 1]))), "symmetric and not negative, got the eigenvalue -1"),
        (in_world(bodies([[1, 1, 0], [0, 1, 0], [0, 0, 1]])), "must be symmetric and not negative"),
    ],
)
def test_a_world_that_is_not_sound_is_found(experiment: Experiment, sentence: str) -> None:
    """A drawing has the worlds that are declared, each with a unit, and beliefs in them have a covariance."""
    with pytest.raises(CheckError, match=sentence):
        checks_of(experiment)["what is drawn in a world keeps to it"]()


@pytest.mark.parametrize(
    ("make", "sentence"),
    [
        (lambda: boasting(30.0), "the band of the estimate of .*: it is declared right, and is underconfident"),
        (
            broken.escaping,
            "the band of the region of 100 % holds the truth in 90.9 % of the reports: it is declared right",
        ),
    ],
)
def test_a_band_that_is_off_is_found_either_way(make: Callable[[], Experiment], sentence: str) -> None:
    """One that is too wide fails as well, and a region that loses the truth in one frame."""
    with pytest.raises(CheckError, match=sentence):
        checks_of(make())["bands hold the truth as often as they say"]()


@pytest.mark.parametrize("found", ["overconfident", "uncalibrated"])
def test_a_band_that_is_not_declared_right_passes(found: Finding) -> None:
    """Who promises nothing of a method that is off needs no declaration, and may have one."""
    checks_of(boasting(0.02, found))["bands hold the truth as often as they say"]()


def test_a_wrong_declaration_is_found() -> None:
    """Over many runs the exact filter is right; whoever says otherwise of it says what is not so."""
    tested = BandTest(("kalman",), found="overconfident")
    experiment = replace(SOUND, quality=Quality(Calibration(tested=(tested,))))
    (check,) = (one for one in experiment_checks(experiment, thorough=True) if str(one).endswith("(kalman, default)"))
    with pytest.raises(CheckError, match=r"the band of the estimate of .*: it is declared overconfident, and is right"):
        check()


def test_every_check_is_tried() -> None:
    """No check is left without an experiment that fails it, and no broken experiment without its check."""
    assert checks_of(find("ball")).keys() == BROKEN.keys()


def test_an_estimate_that_depends_on_the_process_is_found(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """What differs from process to process, such as its number, does not pass."""
    source = (
        "import os\nfrom dataclasses import replace\nimport numpy as np\n"
        "from pftrack.experiments import find\nfrom pftrack.experiments.experiment import Quality\n"
        "SINE = find('sine')\nKALMAN = SINE.trackers['kalman']\n"
        "def start(target, frame, parameters, rng):\n"
        "    state = KALMAN.start(target, frame, parameters, rng)\n"
        "    return replace(state, posterior=replace(state.posterior, mean=state.posterior.mean + os.getpid()))\n"
        "TRACKERS = {'kalman': replace(KALMAN, start=start)}\n"
        "EXPERIMENT = replace(\n"
        "    SINE, id='pids', trackers=TRACKERS, quality=Quality(), interface=4\n"
        ")\n"
    )
    install(tmp_path, "of-the-process", source, "pids = of_the_process:EXPERIMENT")
    monkeypatch.setenv("PYTHONPATH", environment(tmp_path)["PYTHONPATH"])
    monkeypatch.setattr(sys, "path", [str(tmp_path), *sys.path])
    from of_the_process import EXPERIMENT  # type: ignore[import-not-found] # installed just now

    monkeypatch.setitem(EXPERIMENTS._known, "pids", EXPERIMENT)
    with pytest.raises(CheckError, match="another process gives other estimates with the tracker kalman"):
        checks_of(EXPERIMENT)["another process gives the same numbers"]()


def test_what_is_broken_here_is_sound_otherwise() -> None:
    """The experiments here differ from one that passes in one thing only; `check_experiment` raises the first."""
    for name, check in checks_of(SOUND).items():
        if name != "another process gives the same numbers":
            check()
    with pytest.raises(CheckError, match="must be registered"):
        check_experiment(replace(SOUND, id="unlisted"))
