"""Each check of an experiment fails for one that breaks it, with a sentence on the fault."""

import json
import math
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from pftrack.core.model.band import BandTest, Calibration, Finding
from pftrack.core.model.drawing import Ellipsoids, Picture
from pftrack.core.model.marks import Box, Editor, Handle
from pftrack.core.model.parameters import parameter
from pftrack.core.model.preset import Preset
from pftrack.core.model.recipe import Footage
from pftrack.core.model.setup import Suitability
from pftrack.core.refusal import ParameterError
from pftrack.experiments import EXPERIMENTS, find
from pftrack.experiments.experiment import Experiment, Quality
from pftrack.experiments.shared.recording import RecordingSource
from pftrack.experiments.sine.experiment import SineParameters
from pftrack.testing import Check, CheckError, check_experiment, drawings, experiment_checks
from tests.testing import broken
from tests.testing.broken import AFAR, BALL, BROKEN, SOUND, SPACE, Disc, Elsewhere, marked, measuring, wired


@pytest.fixture(autouse=True)
def _registered(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(EXPERIMENTS._known, "under-test", SOUND)


def checks_of(experiment: Experiment) -> dict[str, Check]:
    """Return the checks by name, those of a tracker for the first one."""
    checks: dict[str, Check] = {}
    for check in experiment_checks(experiment):
        checks.setdefault(str(check).partition(" (")[0], check)
    return checks


class Formula(SineParameters, group="Signal"):
    """A description with a symbol in place of words."""

    observation_noise_sd: float = parameter(0.1, "Noise", "Noise sigma_z on what is seen.", within=(0.05, 0.5, 0.05))


class Undescribed(Disc):
    """A mark with a field that its editor does not describe."""

    @classmethod
    def editor(cls) -> Editor:
        return cls.describe(handles=(Handle(name="centre", title="Centre"),))


def bodies(covariance: Any) -> Experiment:
    spread = np.array([covariance], np.float32)
    drawn = Ellipsoids(np.zeros((1, 3), np.float32), spread, np.zeros((1, 3), np.uint8), 0.5, "estimate")
    return broken.in_world(drawn)


def suiting(suits: Callable[..., Any]) -> Experiment:
    return replace(BALL, video=replace(BALL.video, suits=suits))


def wiring(alter: Callable[[Any], Any]) -> Experiment:
    """Return the ball with another setup on recordings."""
    return wired(lambda *given: alter(BALL.video.wire(*given)))


def crashing(*_: Any, **__: Any) -> Any:
    raise ZeroDivisionError("somewhere")


def picturing() -> Experiment:
    return replace(BALL, draw=lambda *given: replace(BALL.draw(*given), primitives={"p": Picture(np.zeros(3))}))


def shorter(setup: Any) -> Any:
    def open_source(seed: int, parameters: Any) -> Any:
        source = setup.open_source(seed, parameters)
        source.frame_count -= 1
        return source

    return replace(setup, open_source=open_source)


def at_sea() -> Experiment:
    """Return the ball with a tracker on recordings that estimates NaN."""
    tracker = BALL.trackers[BALL.default_tracker]

    def start(*given: Any) -> Any:
        state = tracker.start(*given)
        return replace(state, posterior=replace(state.posterior, mean=np.full_like(state.posterior.mean, np.nan)))

    trackers = {**BALL.trackers, BALL.default_tracker: replace(tracker, start=start)}
    return replace(wiring(lambda setup: replace(setup, beside=None)), trackers=trackers)


UNKNOWN = Footage(sha256="0" * 64, mark=Box.of(50, 110, 20, 20).model_dump(mode="json"))
PARAMETERS, MEASURES = "its parameters are declared whole", "its measures are declared whole"
WORLD, BANDS = "what is drawn in a world keeps to it", "bands hold the truth as often as they say"
MARKS, FILM = "its kinds of mark describe themselves", "a film of its scene is tracked from a mark"
PRESETS, BATCH = "its presets run", "a batch gives the numbers of live runs"
ALSO: list[tuple[str, Callable[[], Experiment], str]] = [
    *((name, *case) for name, case in BROKEN.items()),
    (
        PRESETS,
        lambda: replace(SOUND, presets=(Preset("../works", "works", "kalman"),)),
        r"the name of a preset must be .*, got '\.\./works'",
    ),
    (MEASURES, lambda: measuring(name="error"), "every sweep has error: a measure must have another name"),
    (MEASURES, lambda: measuring(name="../curves"), r"the name of a measure must be .*, got '\.\./curves'"),
    (PARAMETERS, lambda: broken.declaring(Formula), r"the help of observation_noise_sd must be in words, .*sigma_z"),
    (BATCH, lambda: broken.folding(lambda _: {"series": {}}), "another observation_share than .*: None for 0"),
    (WORLD, lambda: broken.displaying(broken.in_world(AFAR), worlds=()), "are declared, none, got space"),
    (WORLD, lambda: broken.displaying(SOUND, worlds=(replace(SPACE, unit=""),)), "a name, a title and a unit"),
    (WORLD, lambda: bodies(np.diag([1, np.nan, 1])), "covariances of it in frame 0 must be finite"),
    (WORLD, lambda: bodies(np.diag([1, -1, 1])), "symmetric and not negative, got the eigenvalue -1"),
    (BANDS, lambda: broken.boasting(30.0), "band of the estimate of .*: it is declared right, and is underconfident"),
    (BANDS, broken.escaping, "the region of 100 % holds the truth in 90.9 % of the reports: it is declared right"),
    (MARKS, lambda: marked(Disc, Elsewhere), "must have unique names"),
    ("marks survive their JSON and can be drawn", lambda: marked(Undescribed), r"mark\.radius_px"),
    (FILM, lambda: suiting(broken.refusing), "must look how .* without an error, got ValueError: too dark"),
    (FILM, lambda: suiting(lambda *_: 0.5), "must be a Suitability, got 0.5"),
    (
        FILM,
        lambda: suiting(lambda *_: Suitability(0.5, "fine", likelihood=np.full((3, 4), math.nan))),
        r"must be \(height, width\) numbers from 0 to 1, got \(3, 4\)",
    ),
    (FILM, lambda: suiting(lambda *_: Suitability(0.5, "Fine.")), r"must be clauses without full stops, got 'Fine\.'"),
    (FILM, lambda: wired(crashing), "must be taken or refused by a ValueError, got ZeroDivisionError: somewhere"),
    (FILM, lambda: wiring(lambda setup: replace(setup, footage=UNKNOWN)), "with a box must have the hash of its file"),
    (FILM, lambda: wiring(shorter), "has 8 pictures to track, and the run has 7 frames"),
    (FILM, at_sea, r"the estimate in frame 0 of a recording with a box with the tracker h-spf is \(nan, nan\)"),
    (FILM, picturing, "p in frame 0 of a recording with a box .* cannot be shown: image_rgb must be"),
]


@pytest.mark.parametrize(("name", "make", "sentence"), ALSO)
def test_each_check_can_fail(
    name: str, make: Callable[[], Experiment], sentence: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """An experiment that is broken in one way fails the check of that, with a sentence."""
    experiment = make()
    if experiment.id in EXPERIMENTS:
        monkeypatch.setitem(EXPERIMENTS._known, experiment.id, experiment)
    with pytest.raises((CheckError, ParameterError), match=sentence):
        checks_of(experiment)[name]()


def test_every_check_is_tried() -> None:
    """Each check has an experiment that fails it, and each broken experiment its check."""
    assert checks_of(find("ball")).keys() == BROKEN.keys()


def test_an_estimate_that_depends_on_the_process_is_found(monkeypatch: pytest.MonkeyPatch) -> None:
    """Estimates must not vary from process to process."""
    monkeypatch.setattr("pftrack.testing.numbers.hashes_elsewhere", lambda files: ["another"] * len(files))
    with pytest.raises(CheckError, match="another process gives other estimates with the tracker kalman"):
        checks_of(SOUND)["another process gives the same numbers"]()


@pytest.mark.parametrize("found", ["overconfident", "uncalibrated"])
def test_a_band_that_is_not_declared_right_passes(found: Finding) -> None:
    """An overconfident method passes if its experiment declares that, or makes no claim."""
    checks_of(broken.boasting(0.02, found))[BANDS]()


def test_a_wrong_declaration_is_found() -> None:
    """Over many runs the exact filter is right; a declaration of anything else fails."""
    tested = BandTest(("kalman",), found="overconfident")
    experiment = replace(SOUND, quality=Quality(Calibration(tested=(tested,))))
    (check,) = (one for one in experiment_checks(experiment, thorough=True) if str(one).endswith("(kalman, default)"))
    with pytest.raises(CheckError, match=r"the band of the estimate of .*: it is declared overconfident, and is right"):
        check()


def test_the_sound_experiment_passes() -> None:
    """So do two kinds of mark of its own; `check_experiment` raises the first failure."""
    for name, check in checks_of(SOUND).items():
        if name != "another process gives the same numbers":
            check()
    for name, check in checks_of(marked(Disc, Box)).items():
        if "mark" in name and name != FILM:
            check()
    with pytest.raises(CheckError, match="must be registered"):
        check_experiment(replace(SOUND, id="unlisted"))


def test_a_mark_is_read_from_json() -> None:
    """The command line reads a kind without a text form of its own from JSON, too."""
    raw = '{"centre": [4, 5], "radius_px": 3}'
    assert Disc.parse(raw).centre == Disc.read(json.loads(raw)).centre == (4, 5)
    with pytest.raises(ValueError, match=r"the file .* does not exist"):
        Disc.parse("no file")


def test_a_kind_that_knows_no_target_is_placed_as_an_editor_begins() -> None:
    """Its handles are at the editor's places in the film's own size, and the mark may be refused in a sentence."""
    seen: list[Any] = []

    def wire(sequence: Any, mark: Any, *_: Any) -> Any:
        seen.append((sequence.size, mark.centre, mark.radius_px))
        raise ParameterError("mark", "this", "something else")

    drawings._a_film_is_tracked(wired(wire, marks=(Disc,)))
    assert seen == [((320, 240), (159.5, 119.5), 20)] * 2


def test_the_film_is_of_the_scene(monkeypatch: pytest.MonkeyPatch) -> None:
    """A run tracks decoded pictures of the scene, from a mark at the true position."""
    starts: list[Any] = []
    begin = RecordingSource.__init__

    def noting(self: Any, sequence: Any, *given: Any, **named: Any) -> None:
        begin(self, sequence, *given, **named)
        starts.append((sequence, self.start.position))

    monkeypatch.setattr(RecordingSource, "__init__", noting)
    drawings._a_film_is_tracked(BALL)
    (sequence, first), (_, later) = starts[0], starts[-1]
    assert sequence.frame_count == 8
    assert first.tolist() == pytest.approx([60.0, 120.0], abs=0.5)
    assert later[0] > 60.5
