"""Why a target was lost, said from a run's own numbers."""

import math
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

import pftrack
from pftrack.analysis.diagnosis import OPEN_SET, Diagnosis, diagnose, diagnose_course
from pftrack.analysis.diagnosis.course import Course, course_of, sign
from pftrack.analysis.diagnosis.rules import mirror_image, wrong_find
from pftrack.core.model.parameters import Value
from pftrack.core.model.preset import CAUSES, CauseId
from pftrack.core.model.recipe import Change, Recipe
from pftrack.core.model.series import Series
from pftrack.core.model.tracker import Diagnostics
from pftrack.experiments import find
from pftrack.reproduce.pool import begin
from pftrack.runs.loss import Loss
from pftrack.runs.run import Run
from tools.diagnosis import Spoiled, without_truth

CALM: dict[str, Value] = {"occlusion_width_px": 0, "distracter_radius_px": 0, "process_noise_px": 6}


@cache
def ball(tracker: str, seed: int = 0, **values: Value) -> Run:
    """Return sixty frames of the ball, with nothing in its way but what is said."""
    return pftrack.run("ball", tracker=tracker, seed=seed, frames=60, **{**CALM, **values})


def unaided(run: Run) -> Diagnosis:
    """Return the diagnosis of the loss of a run if no truth is known."""
    return diagnose_course(without_truth(run), next(row.frame for row in run.diagnostics if row.is_lost))


UNAIDED: list[tuple[CauseId, str, dict[str, Value]]] = [
    ("wrong-dynamics", "apf", {"velocity_retention": 0.1, "process_noise_px": 2}),
    ("shrinking-covariance", "kalman", {"process_noise_px": 0.1, "period_s": 2}),
    ("detector-seized-by-background", "pc-pf", {"background_colour": "#a03c3c", "period_s": 2}),
]


@pytest.mark.parametrize(("cause", "tracker", "values"), UNAIDED)
def test_a_cause_is_found_without_the_truth(cause: CauseId, tracker: str, values: dict[str, Value]) -> None:
    """What the tracker computes shows the cause of a loss, in words."""
    found = unaided(ball(tracker, 1, **values))
    assert found.cause == cause
    assert "nan" not in " ".join(sign.words for sign in found.signs)
    assert not {"error", "excess", "true_step"} & {one.name for sign in found.signs for one in sign.evidence}


def test_a_filter_that_is_too_sure_is_refuted_by_its_innovations() -> None:
    """Without the truth the normalised innovation squared is told beside its limit, in words and as evidence."""
    first, *_ = unaided(ball("kalman", process_noise_px=0.1, period_s=2)).signs
    assert first.numbers["nis"] > first.numbers["limit"] == pytest.approx(5.99, abs=0.01)
    assert "it would be below 6.0 in 95 of 100 frames" in first.words
    assert first.evidence[0].name == "nis"


def spoiled(base: Recipe, kind: str, degree: float, frame: int) -> Run:
    """Return a finished run whose pictures or numbers are spoiled from a frame on."""
    setup = find(base.experiment).simulate()
    run = begin(base, lambda seed, values: Spoiled(setup.open_source(seed, values), kind, degree, frame, 4))
    run.finish()
    return run


@pytest.mark.parametrize(
    ("kind", "degree", "cause"),
    [
        ("noise", 0.6, "noisy-picture"),
        ("blur", 0.9, "changed-look"),
        ("light", 0.0, "changed-look"),
        ("blank", 0.5, "nothing-to-measure"),
        ("frozen", 0.5, "nothing-to-measure"),
    ],
)
def test_what_happens_to_all_of_a_picture_is_told_from_the_pictures(kind: str, degree: float, cause: CauseId) -> None:
    """With the truth and without, and since the frame in which it happened; before, the pictures say nothing."""
    base = Recipe(experiment="ball", tracker="condensation", seed=4, frames=40, timeline=(Change(0, CALM),))
    run = spoiled(base, kind, degree, 14)
    for found in (diagnose(run), unaided(run)):
        # The first one that is frozen is as it was.
        assert (found.cause, found.signs[0].since) == (cause, 14 + (kind == "frozen"))
    assert {sign.cause for sign in diagnose_course(without_truth(run), 10).signs} == set()


@pytest.mark.parametrize(("kind", "cause"), [("noise", "noisy-picture"), ("blank", "nothing-to-measure")])
def test_measured_numbers_that_begin_to_jump_are_told(kind: str, cause: CauseId) -> None:
    """A signal's second differences show noise that begins, and missing values that nothing is measured."""
    run = spoiled(Recipe(experiment="sine", tracker="kalman", seed=4, frames=60), kind, 1.0, 30)
    assert diagnose_course(without_truth(run), 33).cause == cause


def test_a_named_cause_comes_with_how_often_such_are_right(monkeypatch: pytest.MonkeyPatch) -> None:
    """The figures are those of the study, by the witness; without a cause, or without figures, nothing is said."""
    run = pftrack.run("ball", preset="too-wide", frames=60)
    monkeypatch.setitem(OPEN_SET, "cases", 0)
    assert not diagnose(run).reliability
    for name, value in (("cases", 200), ("with the truth", 0.9), ("without the truth", 0.8)):
        monkeypatch.setitem(OPEN_SET, name, value)
    told = "In 200 lost runs kept aside, with flaws of any kind, {}% of the causes named {} were right."
    assert diagnose(run).reliability == told.format(90, "with the truth")
    assert replace(diagnose(run), witness="").reliability == told.format(80, "without the truth")
    assert not diagnose(run, 4).reliability


def test_a_target_of_another_colour_is_told_with_the_truth_and_one_that_comes_back_is_not() -> None:
    """From behind the pillar the ball comes back green in one run, and on another path, red as it was, in the other."""
    run = pftrack.run("ball", tracker="h-spf", seed=2, frames=60, distracter_radius_px=0)
    changed, moved = (run.branch(23, values) for values in ({"ball_colour": "#4efb08"}, {"ball_path": "bounces"}))
    for each in (changed, moved):
        each.finish()
        assert each.diagnostics[35].lost
    found = diagnose(changed)
    assert (found.cause, found.signs[0].since) == ("changed-look", 24)
    assert "changed-look" not in {sign.cause for sign in diagnose(moved).signs}


PLACES = pftrack.run("ball", tracker="kalman", frames=40, **CALM).diagnostics
ROLES = {"alike": "likeness", "ess": "ess", "count": "particles"}
CLOUD = tuple(Series(name, name, role=role) for name, role in ROLES.items())


def told(rows: list[Diagnostics], fits: list[float], shares: list[float], count: float = 100.0) -> list[Diagnostics]:
    """Return rows that report fits, and effective sample sizes of a hundred particles."""
    values = [{"alike": fit, "ess": share * count, "count": count} for fit, share in zip(fits, shares, strict=True)]
    return [replace(row, hidden=None, series=value) for row, value in zip(rows, values, strict=True)]


def of(rows: list[Diagnostics], frame: int | None = None) -> Diagnosis:
    """Return the diagnosis of rows that report what `CLOUD` declares."""
    return diagnose_course(course_of(rows, CLOUD, unit="px"), frame)


def test_what_fits_worse_and_worse_is_left_behind_and_not_taken_for_another() -> None:
    """A likeness that sinks to a third does not fit as before; that the target is in sight is said only if known."""
    rows = told(list(PLACES), [0.9 - 0.03 * min(frame, 20) for frame in range(40)], [0.5] * 40)
    off = [replace(row, error=60.0 if row.frame >= 20 else 1.0, lost=row.frame >= 20) for row in rows]
    assert not of(off).signs  # the estimate goes as far as the target
    off = [row if row.frame < 14 else replace(row, estimate=rows[14].estimate) for row in off]
    found = of(off)
    assert [sign.cause for sign in found.signs] == ["wrong-dynamics"]
    assert "in full sight" not in found.signs[0].words
    assert "in full sight" in of([replace(row, hidden=False) for row in off]).signs[0].words


@pytest.mark.parametrize(
    ("share", "hidden", "cause"),
    [
        (0.6, True, "overconfident-weights"),
        (0.99, True, "occlusion-longer-than-memory"),
        (0.6, False, "unclear"),
        (0.6, None, "unclear"),
    ],
)
def test_weights_are_judged_where_the_target_is_hidden(share: float, hidden: bool | None, cause: CauseId) -> None:
    """Half covered it is told from the rest; where it is known that all is gone, preferring places is too sharp."""
    fits = [0.95] * 20 + [0.8, 0.7, 0.6] + [0.4] * 17
    rows = told(list(PLACES), fits, [0.5] * 20 + [0.7, 0.8, 0.9] + [share] * 17)
    unknown = {"truth": None, "error": None, "lost": None}
    assert of([replace(row, **unknown, hidden=hidden and row.frame >= 23) for row in rows], 26).cause == cause


def test_what_pictures_show_explains_what_a_filter_showed_before() -> None:
    """Few particles since the first frame are no news when the pictures go blank; what comes after them is told."""
    few, blank = sign("too-few-particles", 0, 1.0, count=9, ess=9), sign("blank-pictures", 5, 1.0, contrast=0, before=9)
    course = course_of([replace(row, lost=row.frame > 5) for row in PLACES], CLOUD, unit="px")
    found = diagnose_course(course, rules=[lambda _: few, lambda _: blank])
    assert [each.cause for each in found.signs] == ["nothing-to-measure"]


@pytest.mark.parametrize(("every", "mirrors"), [(1, True), (2, False)])
def test_a_mirror_image_is_followed_and_not_met_now_and_then(every: int, mirrors: bool) -> None:
    """Any great error is nearer to the image in some frames."""
    rows = told([replace(row, lost=row.frame > 20) for row in PLACES], [0.9] * 40, [0.5] * 40)
    mirrored = 1.0 * ((np.arange(40) > 20) & (np.arange(40) % every == 0))
    course = replace(course_of(rows, CLOUD, unit="px"), mirrored=mirrored)
    assert (diagnose_course(course, rules=[mirror_image]).cause == "mirror-pose") is mirrors


def test_an_estimate_comes_to_the_edge_a_little_later_than_the_target() -> None:
    """Without the truth, what is no longer seen just before the estimate leaves the picture has left it as well."""
    run = ball("h-spf", 7, period_s=2.0).branch(14, {"amplitude_px": 190.98, "period_s": 4.0})
    run.finish()
    first, *_ = unaided(run).signs
    assert (first.cause, first.since) == ("target-not-in-the-picture", 35)


def test_without_truth_a_poor_find_is_the_backgrounds() -> None:
    """A search that ends at a place that fits worse than the target did is told as seized by the background."""
    values: dict[str, Value] = {"search_share": 1.0, "found_likeness": 0.6, "look_alike_red": 0.9}
    found = unaided(pftrack.run("histogram", tracker="condensation", frames=110, **values))
    assert found.cause == "detector-seized-by-background"
    assert "where the target had fitted by 0.9" in found.signs[0].words


def test_several_causes_are_told_in_the_order_in_which_they_began() -> None:
    """Behind a wide pillar the target is lost first, and then a look-alike found; the numbers are the run's own."""
    run = pftrack.run("ball", preset="too-wide", frames=60)
    found = diagnose(run)
    begun = [(sign.cause, sign.since) for sign in found.signs]
    assert begun == [("occlusion-longer-than-memory", 6), ("look-alike-capture", 15)]
    assert found.sentence == (
        "Lost in frame 15, first in frame 7: occlusion longer than memory, since frame 6; "
        "then look-alike capture, since frame 15."
    )
    hidden = sum(row.hidden is True for row in run.diagnostics[6:15])
    assert found.signs[0].numbers["frames"] == hidden == 4


def test_a_target_that_is_found_again_is_not_another_that_fits() -> None:
    """What is followed after a loss of two frames is the ball itself, 4 px away, and fits less than it did."""
    run = pftrack.run("ball", preset="works", seed=0, frames=240).branch(227, {"occlusion_width_px": 90})
    run.finish()
    assert run.diagnostics[-1].lost is False
    assert [sign.cause for sign in diagnose(run).signs] == ["occlusion-longer-than-memory"]


def test_a_run_that_holds_has_nothing_to_explain() -> None:
    """Without a loss this is said; a frame in which all is well has no sign.

    What is not a computed frame is refused; any frame of a loss has the diagnosis of its first.
    """
    run = ball("h-spf")
    assert diagnose(run).sentence == "The target is not lost in any frame computed so far."
    calm = diagnose(run, 40)
    assert (calm.lost, calm.cause, calm.sentence) == (False, "unclear", "Frame 40: the numbers show nothing wrong.")
    for frame in (-1, 60, 3.5, float("nan")):
        with pytest.raises(ValueError, match=f"frame must be a frame that has been computed, 0 to 59, got {frame}"):
            diagnose(run, frame)  # type: ignore[arg-type] # a caller without types may give anything
    run = ball("apf", velocity_retention=0.1, process_noise_px=2)
    first = next(row.frame for row in run.diagnostics if row.is_lost)
    assert diagnose(run, first + 3) == diagnose(run, first) == diagnose(run)


def test_without_truth_lost_is_the_trackers_own_word() -> None:
    """A tracker that says that it searches is believed; of one that says nothing nothing is said unless it is asked."""
    run = pftrack.run("histogram", preset="searches", frames=105)
    found = diagnose_course(without_truth(run))
    begun = next(row.frame for row in run.diagnostics if row.searching)
    assert (found.witness, found.frame) == ("tracker", begun)
    assert found.sentence.startswith(f"Lost in frame {begun} by its own account: ")
    silent = diagnose_course(without_truth(ball("h-spf")))
    assert (silent.frame, silent.witness) == (None, "")
    assert silent.sentence.startswith("pftrack cannot tell whether the target is lost")


def standing_target(*, marked: slice) -> Course:
    """Return what a filter that is right about itself makes of a target that stands still.

    Args:
        marked: The frames with a known truth.
    """
    run = ball("kalman")
    sigma, true = 2.0, (100.0, 100.0)
    rows = []
    for row, place in zip(run.diagnostics, np.random.default_rng(0).normal(true, sigma, (60, 2)), strict=True):
        spread = tuple(sigma for _ in row.sigma)
        rows.append(replace(row, estimate=tuple(place.tolist()), sigma=spread, truth=None, error=None, lost=None))
    for place, row in list(enumerate(rows))[marked]:
        rows[place] = replace(row, truth=true, error=math.dist(row.estimate, true), lost=False)
    return course_of(rows, run.experiment.all_series(), unit="px")


def test_a_filter_that_is_right_of_a_standing_target_is_not_called_too_sure() -> None:
    """An error of more than two deviations is seen every few frames; that most are so great is another matter.

    Where a person has marked few pictures nothing is said of errors elsewhere.
    """
    course = standing_target(marked=slice(0, 60))
    assert (course.excess > 2.0).sum() > 3
    assert {diagnose_course(course, frame).cause for frame in range(60)} == {"unclear"}
    assert not diagnose_course(standing_target(marked=slice(10, 12)), 40).signs


def test_too_few_particles_explain_a_loss_in_the_first_frame() -> None:
    """No earlier frame shows the target, so the sentence names none.

    A single particle, whose deviation is zero in every frame, is too few as well.
    """
    found = diagnose(ball("condensation", sample_count=1))
    assert (found.cause, found.lost, found.witness) == ("sample-impoverishment", True, "truth")
    assert f": {CAUSES['sample-impoverishment']}, since frame " in found.sentence
    run = ball("condensation", sample_count=12)
    rows = [replace(row, lost=row.frame >= 1) for row in run.diagnostics]
    found = diagnose_course(course_of(rows, run.experiment.all_series(), unit="px"))
    assert found.frame == 1
    assert found.signs[0].words == "There are 12 particles: too few to be near it wherever it may go."


def test_a_search_of_an_earlier_loss_does_not_explain_a_later_one() -> None:
    """What a search has wrongly found explains the loss that it belongs to, and not one long after."""
    run = pftrack.run("histogram", tracker="condensation", frames=110)
    frames = np.arange(110)
    course = replace(
        course_of(run.diagnostics, run.experiment.all_series(), unit="px"),
        loss=Loss(((frames >= 20) & (frames < 40)) | (frames >= 80), ("truth",) * 110),
        searching=((frames >= 20) & (frames < 25)).astype(np.float64),
    )
    first, second = (diagnose_course(course, frame, [wrong_find]) for frame in (20, 80))
    assert [sign.numbers["found"] for sign in first.signs] == [25]
    assert not second.signs
