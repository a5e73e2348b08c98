import numpy as np
import pytest
from numpy.typing import NDArray
from pydantic import ValidationError

from pftrack.filters.learning.charts import Chart, Reading, advance_states, changes, steps

FISH = Chart(place=("a", "b"), heading="theta", angles=("phi",))
BALL = Chart(place=("u", "v"))
POSE = Chart(angles=("x", "y", "z"))
BIRD = Chart(place=("x", "y", "z"), heading="yaw", numbers=("wing",))
READINGS: tuple[Reading, ...] = ("document", "increments", "world")


def rotation(angle: float) -> NDArray[np.float64]:
    return np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])


def walk(frames: int = 40, seed: int = 0) -> NDArray[np.float64]:
    """A track that wanders, turns and bends."""
    return np.cumsum(np.random.default_rng(seed).normal(size=(frames, 4)) * [3, 3, 0.3, 0.2], axis=0)


def expected(track: NDArray[np.float64], reading: Reading) -> NDArray[np.float64]:
    """Eqs 10-14 frame by frame, as they are written."""
    rows = []
    for t in range(2, len(track)):
        place, heading = track[:, :2], track[:, 2]
        now, before = place[t] - place[t - 1], place[t - 1] - place[t - 2]
        if reading == "increments":
            accelerations = rotation(-heading[t]) @ now - rotation(-heading[t - 1]) @ before
        else:
            accelerations = rotation(-heading[t]) @ (now - before)
        rows.append([*accelerations, *(track[t, 2:] - track[t - 1, 2:])])
    return np.array(rows)


@pytest.mark.parametrize("reading", READINGS)
def test_changes_are_those_of_the_equations(reading: Reading) -> None:
    """Changes are eqs 10-14, frame by frame; the third reading learns what the first does."""
    assert changes(walk(), FISH, reading) == pytest.approx(expected(walk(), reading), abs=1e-12)


def test_an_even_circle_has_speed_times_turn_across() -> None:
    """By the paper's reading an even circular swim has b'' = s sin(theta'); its body-frame velocity is constant."""
    turn, speed = 0.1, 7.0
    headings = turn * np.arange(60)
    velocities = speed * np.column_stack([np.cos(headings), np.sin(headings)])
    track = np.column_stack([np.cumsum(velocities, axis=0), headings, np.zeros(60)])
    written = changes(track, FISH, "document")
    assert written[:, 0] == pytest.approx(speed * (1 - np.cos(turn)))
    assert written[:, 1] == pytest.approx(speed * np.sin(turn))
    assert changes(track, FISH, "increments")[:, :2] == pytest.approx(0, abs=1e-12)


def test_a_place_without_a_heading_may_turn_with_its_motion() -> None:
    """Without a heading the frame is the picture's, or that of the motion before: turning the track matters no more."""
    track = walk()[:, :2]
    turned = track @ rotation(1.2).T
    assert changes(track, BALL, "fixed") == pytest.approx(np.diff(track, 2, axis=0))
    assert changes(turned, BALL, "motion") == pytest.approx(changes(track, BALL, "motion"))
    assert not np.allclose(changes(turned, BALL, "fixed"), changes(track, BALL, "fixed"))


def test_a_bounce_is_along_what_the_ball_did() -> None:
    """A ball that comes straight back has lost twice its speed along its motion, and nothing across."""
    track = np.array([[0, 0], [3, 4], [6, 8], [3, 4]])
    assert changes(track, BALL, "motion") == pytest.approx(np.array([[0, 0], [-10, 0]]))
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


def move(state: NDArray[np.float64], drawn: NDArray[np.float64], reading: Reading) -> NDArray[np.float64]:
    """Move one fish by eqs 16 and 17, as they are written."""
    place, velocity, heading, bend = state[:2], state[2:4], state[4], state[5]
    turned = heading + drawn[2]
    if reading == "world":
        inside = rotation(-turned) @ (rotation(heading) @ velocity + rotation(turned) @ drawn[:2])
    else:
        inside = velocity + drawn[:2]
    return np.array([*(place + rotation(turned) @ inside), *inside, turned, bend + drawn[3]])


@pytest.mark.parametrize("reading", READINGS)
def test_particles_move_by_the_equations(reading: Reading) -> None:
    """Each ancestor moves by eqs 16-18: new heading and new velocity first, then the place by them."""
    rng = np.random.default_rng(2)
    states, ancestors = rng.normal(size=(5, 6)), np.array([4, 0, 0, 2])
    root, mean, normals = np.tril(rng.normal(size=(4, 4))), rng.normal(size=4), rng.normal(size=(4, 4))
    moved = advance_states(states, ancestors, normals, root, mean, FISH, reading)
    for n, parent in enumerate(ancestors):
        assert moved[n] == pytest.approx(move(states[parent], mean + root @ normals[:, n], reading))


@pytest.mark.parametrize(
    ("chart", "reading"),
    [(FISH, "increments"), (FISH, "world"), (BIRD, "increments"), (BALL, "fixed"), (BALL, "motion"), (POSE, "fixed")],
)
def test_what_moves_the_particles_is_learned_back(chart: Chart, reading: Reading) -> None:
    """The changes of a track that was made by drawn changes are those that were drawn: chart and step are inverse."""
    rng = np.random.default_rng(3)
    size, places = len(chart.names), len(chart.place)
    root = np.tril(rng.normal(size=(size, size))) * 0.3
    state, track, drawn = rng.normal(size=(1, size + places)), [], []
    kept = [*range(places), *range(2 * places, size + places)]
    for _ in range(30):
        normals = rng.normal(size=(size, 1))
        state = advance_states(state, np.zeros(1, np.int64), normals, root, np.zeros(size), chart, reading)
        track.append(state[0, kept])
        drawn.append(root @ normals[:, 0])
    assert changes(track, chart, reading) == pytest.approx(np.array(drawn)[2 if places else 1 :], abs=1e-9)


@pytest.mark.parametrize(
    ("fields", "words"),
    [
        ({"place": ("a",)}, "0, 2 or 3 coordinates"),
        ({"heading": "theta"}, "a place along with the heading"),
        ({"place": ("a", "b"), "angles": ("a",)}, "names that differ"),
        ({}, "names that differ, got none"),
    ],
)
def test_charts_that_make_no_sense_are_refused(fields: dict[str, object], words: str) -> None:
    """A chart says what is wrong with it."""
    with pytest.raises(ValidationError, match=words):
        Chart.model_validate(fields)


def test_states_that_do_not_fit_are_refused() -> None:
    """States, particles and readings that do not fit the chart are refused with both sides."""
    with pytest.raises(ValueError, match=r"states of 4 numbers \(a, b, theta, phi\), got shape \(5, 3\)"):
        changes(np.zeros((5, 3)), FISH, "document")
    with pytest.raises(ValueError, match="a reading fixed or motion of u, v, got document"):
        changes(np.zeros((5, 2)), BALL, "document")
    with pytest.raises(ValueError, match="particles of 6 numbers and 4 changes, got 5"):
        advance_states(
            np.zeros((2, 5)), np.zeros(2, np.int64), np.zeros((4, 2)), np.eye(4), np.zeros(4), FISH, "document"
        )
