"""Learned motions: charts, what tracks teach, and how rows become states to learn from."""

import json
from collections.abc import Callable
from contextlib import suppress
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydantic import ValidationError

from pftrack.core.model.tracker import Diagnostics
from pftrack.core.refusal import ConflictError, ParameterError, RefusedError
from pftrack.filters.learning.charts import Chart, Reading, advance_states, changes, steps
from pftrack.filters.learning.diffusion import Guidance, Learned, learn

FISH = Chart(place=("a", "b"), heading="theta", angles=("phi",))
TRUE = np.array([[1.0, 0.2, 0.0, 0.0], [0.2, 2.0, 0.05, -0.02], [0.0, 0.05, 0.02, -0.015], [0.0, -0.02, -0.015, 0.02]])


def swim(frames: int, seed: int, reading: Reading = "increments") -> np.ndarray:
    """A track whose changes have the true covariance."""
    rng, state, track = np.random.default_rng(seed), np.zeros((2, 6)), []
    root = np.linalg.cholesky(TRUE)
    for _ in range(frames):
        normals = np.tile(rng.standard_normal((4, 1)), 2)  # a single particle would need functions of its own
        state = advance_states(state, np.zeros(2, np.int64), normals, root, np.zeros(4), FISH, reading)
        track.append(state[0, [0, 1, 4, 5]])
    return np.array(track)


TRACKS = [swim(60, seed) for seed in range(4)]
LEARNED = learn(TRACKS, FISH, "fish")


def test_it_is_the_sample_covariance() -> None:
    """Mean and covariance are NumPy's of the changes of all tracks together; those of the steps as well.

    What is written and read again is equal.
    """
    every = np.vstack([changes(track, FISH, "document") for track in TRACKS])
    diffusion = LEARNED.diffusion("document", drifting=True)
    assert diffusion.covariance == pytest.approx(np.cov(every.T))
    assert diffusion.mean == pytest.approx(every.mean(axis=0))
    moved = np.vstack([steps(track, FISH) for track in TRACKS])
    assert LEARNED.step_mean == pytest.approx(moved.mean(axis=0))
    assert LEARNED.step_sd == pytest.approx(moved.std(axis=0, ddof=1))
    assert (LEARNED.tracks, LEARNED.frames, LEARNED.origin) == (4, 240, "4 tracks, 240 frames")
    again = Learned.read(LEARNED.text, experiment="fish", chart=FISH)
    assert (again, again.text) == (LEARNED, LEARNED.text)


def test_modes_are_the_eigenvectors() -> None:
    """Modes and eigenvalues make up the covariance, the greatest first, each mode with its greatest entry positive.

    Without correlations each change keeps its standard deviation; a scale multiplies all of them.
    """
    diffusion = LEARNED.diffusion("document")
    modes, values = diffusion.modes, diffusion.eigenvalues
    assert (modes * values) @ modes.T == pytest.approx(diffusion.covariance)
    assert modes.T @ modes == pytest.approx(np.eye(4), abs=1e-12)
    assert list(values) == sorted(values, reverse=True)
    assert (modes[np.abs(modes).argmax(axis=0), np.arange(4)] > 0).all()
    assert diffusion.root @ diffusion.root.T == pytest.approx(diffusion.covariance)
    assert not diffusion.mean.any()
    alone = LEARNED.diffusion("document", correlated=False, scale=2.0)
    assert alone.covariance == pytest.approx(np.diag(4 * np.diagonal(diffusion.covariance)))
    assert alone.correlation == pytest.approx(np.eye(4))
    assert alone.sd == pytest.approx(2 * diffusion.sd)


@pytest.mark.parametrize(
    ("tracks", "words"),
    [
        ([TRACKS[0][:21]], "got 19 in 1 track; learn from longer runs, or from more of them"),
        ([TRACKS[0] * [1, 1, 1, 0]], "'phi' never changes in it, so no particle would ever change it either"),
        ([TRACKS[0] * [1e9, 1, 1, 1]], "at most 1e.06 px/frame² as a'', got"),
    ],
)
def test_tracks_that_teach_nothing_are_refused(tracks: list[np.ndarray], words: str) -> None:
    """Too few frames, a component that never changes and absurd changes are refused, each with what to do."""
    with pytest.raises(RefusedError, match=words):
        learn(tracks, FISH, "fish")


def test_changes_that_always_come_together_are_kept() -> None:
    """A covariance may be singular: what always came together in the tracks is always drawn together."""
    track = TRACKS[0].copy()
    track[:, 3] = -track[:, 2]
    diffusion = learn([track], FISH, "fish").diffusion("document")
    assert diffusion.eigenvalues[-1] == pytest.approx(0, abs=1e-12)
    drawn = diffusion.root @ np.random.default_rng(0).standard_normal((4, 50))
    assert drawn[3] == pytest.approx(-drawn[2], abs=1e-12)


def altered(change: Callable[[Any, Any], object]) -> str:
    """Return the file after a change of all of it, or of its first covariance."""
    raw = json.loads(LEARNED.text)
    change(raw, raw["spreads"][0]["covariance"])
    return json.dumps(raw)


def crossed(_: Any, spread: list[list[float]]) -> None:
    spread[0][1] = spread[1][0] = 9.0


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (LEARNED.text[:700], "it was cut short"),
        ("[" * 100_000, "it is not the JSON"),
        ('{"points": []}', "it is not a learned motion, as `pftrack learn` writes it"),
        (altered(lambda raw, _: raw.update(version=2)), "it has format 2, and this version of pftrack reads 1"),
        (altered(lambda raw, _: raw.update(experiment="ball")), "it was learned in 'ball', and this is 'fish'"),
        (altered(lambda raw, _: raw.pop("spreads")), "spreads: field required"),
        (altered(lambda raw, _: raw["chart"].update(heading="psi")), r"learned of a \(px\), b \(px\), psi \(rad\), p"),
        (altered(lambda raw, _: raw["spreads"].pop()), "spreads of the readings document, increments"),
        (altered(lambda _, spread: spread.pop()), "4 means and 4 x 4 covariances"),
        (altered(lambda _, spread: spread[0].__setitem__(0, -1.0)), "a variance of -1 of a''"),
        (altered(lambda _, spread: spread[3].__setitem__(3, 0.0)), "'phi' never changes in it"),
        (altered(lambda _, spread: spread[0].__setitem__(0, 1e300)), "less than or equal to"),
        (altered(lambda _, spread: spread[0].__setitem__(1, 9.0)), "a symmetric covariance"),
        (altered(crossed), "a variance below 0"),
    ],
)
def test_files_that_do_not_fit_are_refused(text: str, words: str) -> None:
    """A wrong form, experiment, chart or version, and what is not a covariance, is refused with one sentence."""
    with pytest.raises(RefusedError, match=words):
        Learned.read(text, experiment="fish", chart=FISH)


@given(st.integers(0, len(LEARNED.text)), st.text(max_size=3))
def test_no_damaged_file_does_more_than_be_refused(place: int, scrap: str) -> None:
    """A file that was written into is read as a learned motion or refused, and raises nothing else."""
    with suppress(RefusedError):
        text = LEARNED.text[:place] + scrap + LEARNED.text[place + 1 :]
        assert Learned.read(text, experiment="fish", chart=FISH).experiment == "fish"


BALL = Chart(place=("u", "v"))
POSE = Chart(angles=("x", "y", "z"))
BIRD = Chart(place=("x", "y", "z"), heading="yaw", numbers=("wing",))
READINGS: tuple[Reading, ...] = ("document", "increments", "world")


def rotation(angle: float) -> np.ndarray:
    return np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])


def walk(frames: int = 40, seed: int = 0) -> np.ndarray:
    """A track that wanders, turns and bends."""
    return np.cumsum(np.random.default_rng(seed).normal(size=(frames, 4)) * [3, 3, 0.3, 0.2], axis=0)


@pytest.mark.parametrize("reading", READINGS)
def test_changes_are_those_of_the_equations(reading: Reading) -> None:
    """Changes are eqs 10-14, frame by frame as they are written; the third reading learns what the first does."""
    track, rows = walk(), []
    for t in range(2, len(track)):
        place, heading = track[:, :2], track[:, 2]
        now, before = place[t] - place[t - 1], place[t - 1] - place[t - 2]
        accelerations = rotation(-heading[t]) @ (now - before)
        if reading == "increments":
            accelerations = rotation(-heading[t]) @ now - rotation(-heading[t - 1]) @ before
        rows.append([*accelerations, *(track[t, 2:] - track[t - 1, 2:])])
    assert changes(track, FISH, reading) == pytest.approx(np.array(rows), abs=1e-12)


def test_a_place_without_a_heading_may_turn_with_its_motion() -> None:
    """Without a heading the frame is the picture's, or that of the motion before: turning the track then has no effect.

    A ball that comes straight back has lost twice its speed along its motion, and nothing across.
    """
    track = walk()[:, :2]
    turned = track @ rotation(1.2).T
    assert changes(track, BALL, "fixed") == pytest.approx(np.diff(track, 2, axis=0))
    assert changes(turned, BALL, "motion") == pytest.approx(changes(track, BALL, "motion"))
    assert not np.allclose(changes(turned, BALL, "fixed"), changes(track, BALL, "fixed"))
    bounce = changes(np.array([[0, 0], [3, 4], [6, 8], [3, 4]]), BALL, "motion")
    assert bounce == pytest.approx(np.array([[0, 0], [-10, 0]]))
    assert changes(np.zeros((3, 2)), BALL, "motion") == pytest.approx(np.zeros((1, 2)))


def test_gaps_split_a_track() -> None:
    """Nothing is learned across a frame that is not known, nor from the two after it; infinity is not known either."""
    track = walk(12)
    track[5, 3], track[9, 0] = np.nan, np.inf
    whole = changes(walk(12), FISH, "document")
    assert changes(track, FISH, "document") == pytest.approx(whole[[0, 1, 2, 6]])
    assert steps(track, FISH) == pytest.approx(np.diff(walk(12), axis=0)[[0, 1, 2, 3, 6, 7, 10]])
    assert len(changes(np.full((5, 4), np.nan), FISH, "document")) == 0
    assert len(changes(np.zeros((1, 4)), FISH, "document")) == 0


def test_angles_may_jump_by_full_turns() -> None:
    """Angles are unwrapped: one that jumps by full turns changes as one that does not; numbers are left alone."""
    track = walk()
    jumping = track.copy()
    jumping[:, 2:] = (track[:, 2:] + np.pi) % (2 * np.pi) - np.pi
    assert changes(jumping, FISH, "document") == pytest.approx(changes(track, FISH, "document"))
    assert steps([[0, 0, 0, 0, 0.0], [0, 0, 0, 0, 7.0]], BIRD)[0, 4] == 7.0


@pytest.mark.parametrize(
    ("chart", "reading"),
    [(FISH, "increments"), (FISH, "world"), (BIRD, "increments"), (BALL, "fixed"), (BALL, "motion"), (POSE, "fixed")],
)
def test_what_moves_the_particles_is_learned_back(chart: Chart, reading: Reading) -> None:
    """The changes of a track that was made by drawn changes are those that were drawn: chart and step are inverse."""
    rng = np.random.default_rng(3)
    size, places = len(chart.names), len(chart.place)
    root = np.tril(rng.normal(size=(size, size))) * 0.3
    state, track, drawn = np.tile(rng.normal(size=size + places), (2, 1)), [], []
    kept = [*range(places), *range(2 * places, size + places)]
    for _ in range(30):
        normals = np.tile(rng.normal(size=(size, 1)), 2)
        state = advance_states(state, np.zeros(2, np.int64), normals, root, np.zeros(size), chart, reading)
        track.append(state[0, kept])
        drawn.append(root @ normals[:, 0])
    assert changes(track, chart, reading) == pytest.approx(np.array(drawn)[2 if places else 1 :], abs=1e-9)


def test_charts_that_make_no_sense_are_refused() -> None:
    """A chart says what is wrong with it."""
    differ = "names that differ"
    for fields, words in (
        ({"place": ("a",)}, "0, 2 or 3 coordinates"),
        ({"place": ("a", "b"), "angles": ("a",)}, differ),
        ({}, f"{differ}, got none"),
    ):
        with pytest.raises(ValidationError, match=words):
            Chart.model_validate(fields)


def test_states_that_do_not_fit_are_refused() -> None:
    """States, particles and readings that do not fit the chart are refused with both sides."""
    with pytest.raises(ValueError, match=r"states of 4 numbers \(a, b, theta, phi\), got shape \(5, 3\)"):
        changes(np.zeros((5, 3)), FISH, "document")
    drawn = np.zeros(2, np.int64), np.zeros((4, 2)), np.eye(4), np.zeros(4)
    with pytest.raises(ValueError, match="particles of 6 numbers and 4 changes, got 5"):
        advance_states(np.zeros((2, 5)), *drawn, FISH, "document")


# How an experiment's rows become states to learn from.

TRACK = np.cumsum(np.random.default_rng(0).normal(size=(40, 4)), axis=0)
BUILT_IN = learn([TRACK], FISH, "fish").text
GUIDANCE = Guidance("fish", FISH, BUILT_IN, series="body")

ROW = Diagnostics(0, 0.0, (1.0, 2.0), (1.0, 1.0), 0.0, None, None, None, None, None, None, None, 0.1)


def rows() -> list[Diagnostics]:
    return [replace(ROW, frame=frame, series={"body": tuple(state.tolist())}) for frame, state in enumerate(TRACK)]


def test_states_are_read_from_the_declared_series() -> None:
    """A row's state is its vector; a frame that is lost, searched for or without the vector is a gap.

    A row that holds fewer or more numbers than a state has is refused by its frame.
    """
    several = rows()
    assert np.array_equal(GUIDANCE.states(several), TRACK)
    for frame, said in ((3, {"lost": True}), (7, {"searching": True}), (9, {"series": {}})):
        several[frame] = replace(several[frame], **said)
    assert np.flatnonzero(np.isnan(GUIDANCE.states(several)).any(axis=1)).tolist() == [3, 7, 9]
    for length in (1, 5):
        several[6] = replace(several[6], series={"body": tuple(range(length))})
        sentence = f"frame 6 must hold a state of a, b, theta, phi to learn from, 4 numbers, got {length}"
        with pytest.raises(RefusedError, match=sentence):
            GUIDANCE.states(several)


def test_estimates_are_brought_to_the_units_of_the_chart() -> None:
    """Without a series the estimate is read, divided by what the experiment's unit is in that of the chart."""
    pose = Guidance("prism", Chart(angles=("x", "y")), "", scale=180 / np.pi)
    assert pose.states([replace(ROW, estimate=(90.0, 180.0))]) == pytest.approx(np.array([[np.pi / 2, np.pi]]))


def test_a_saved_run_gives_the_same_states() -> None:
    """The columns of a file are read as the rows are; a file without them is refused."""
    columns = {"series_body": TRACK, "lost": 1.0 * (np.arange(40) == 4), "searching": np.full(40, np.nan)}
    states = GUIDANCE.saved_states(columns, "run.pft")
    assert np.flatnonzero(np.isnan(states).any(axis=1)).tolist() == [4]
    for damaged in ({}, {"series_body": TRACK[:, :3]}, {"series_body": np.array(["x"])}):
        with pytest.raises(RefusedError, match=r"run\.pft holds no states of a, b, theta, phi"):
            GUIDANCE.saved_states(damaged, "run.pft")


def test_a_learned_motion_is_what_the_run_teaches_the_built_in_one_or_a_file() -> None:
    """The export of a run is what its rows teach; an empty text stands for the built-in one, another is read."""
    export = GUIDANCE.export
    assert export.make(None, rows()).decode() == GUIDANCE.parse("").text == BUILT_IN
    assert (export.suffix, export.media_type) == ("learned.json", "application/json")
    with pytest.raises(ConflictError, match="at least 20 frames"):
        export.make(None, rows()[:5])
    with pytest.raises(ParameterError, match=r"learned must be a learned motion \(it is not JSON"):
        GUIDANCE.parse("nonsense")
