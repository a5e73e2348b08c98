import hashlib
import json
import subprocess
import sys
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from pftrack.core.refusal import RefusedError
from pftrack.filters.learning.charts import Chart, Reading, advance_states, changes, steps
from pftrack.filters.learning.diffusion import Learned, learn

FISH = Chart(place=("a", "b"), heading="theta", angles=("phi",))
TRUE = np.array([[1.0, 0.2, 0.0, 0.0], [0.2, 2.0, 0.05, -0.02], [0.0, 0.05, 0.02, -0.015], [0.0, -0.02, -0.015, 0.02]])


def swim(frames: int, seed: int, reading: Reading = "increments") -> NDArray[np.float64]:
    """A track whose changes have the true covariance."""
    rng, state, track = np.random.default_rng(seed), np.zeros((1, 6)), []
    root = np.linalg.cholesky(TRUE)
    for _ in range(frames):
        normals = rng.standard_normal((4, 1))
        state = advance_states(state, np.zeros(1, np.int64), normals, root, np.zeros(4), FISH, reading)
        track.append(state[0, [0, 1, 4, 5]])
    return np.array(track)


TRACKS = [swim(60, seed) for seed in range(4)]
LEARNED = learn(TRACKS, FISH, "fish")


@pytest.mark.parametrize("reading", ["increments", "world"])
def test_it_converges_to_the_covariance_that_made_the_tracks(reading: Reading) -> None:
    """The learned covariance of 12 000 changes is the true one within four standard errors."""
    found = learn([swim(3000, seed, reading) for seed in range(4)], FISH, "fish").diffusion(reading).covariance
    error = np.sqrt((np.multiply.outer(np.diagonal(TRUE), np.diagonal(TRUE)) + TRUE**2) / 12_000)
    assert (np.abs(found - TRUE) < 4 * error).all()


def test_it_is_the_sample_covariance() -> None:
    """Mean and covariance are NumPy's of the changes of all tracks together; those of the steps as well."""
    every = np.vstack([changes(track, FISH, "document") for track in TRACKS])
    diffusion = LEARNED.diffusion("document", drifting=True)
    assert diffusion.covariance == pytest.approx(np.cov(every.T))
    assert diffusion.mean == pytest.approx(every.mean(axis=0))
    moved = np.vstack([steps(track, FISH) for track in TRACKS])
    assert LEARNED.step_mean == pytest.approx(moved.mean(axis=0))
    assert LEARNED.step_sd == pytest.approx(moved.std(axis=0, ddof=1))
    assert (LEARNED.tracks, LEARNED.frames, LEARNED.origin) == (4, 240, "4 tracks, 240 frames")


def test_modes_are_the_eigenvectors() -> None:
    """Modes and eigenvalues make up the covariance, the greatest first, each mode with its greatest entry positive."""
    diffusion = LEARNED.diffusion("document")
    modes, values = diffusion.modes, diffusion.eigenvalues
    assert (modes * values) @ modes.T == pytest.approx(diffusion.covariance)
    assert modes.T @ modes == pytest.approx(np.eye(4), abs=1e-12)
    assert list(values) == sorted(values, reverse=True)
    assert (modes[np.abs(modes).argmax(axis=0), np.arange(4)] > 0).all()
    assert diffusion.root @ diffusion.root.T == pytest.approx(diffusion.covariance)


def test_correlations_can_be_switched_off_and_the_width_scaled() -> None:
    """Without correlations each change keeps its standard deviation; a scale multiplies all of them."""
    whole = LEARNED.diffusion("document")
    alone = LEARNED.diffusion("document", correlated=False, scale=2.0)
    assert alone.covariance == pytest.approx(np.diag(4 * np.diagonal(whole.covariance)))
    assert alone.correlation == pytest.approx(np.eye(4))
    assert alone.sd == pytest.approx(2 * whole.sd)
    assert not whole.mean.any()


def test_a_file_is_read_back_to_the_bit() -> None:
    """What is written and read again is equal, number for number."""
    again = Learned.read(LEARNED.text, experiment="fish", chart=FISH)
    assert again == LEARNED
    assert again.text == LEARNED.text


def test_another_process_learns_the_same_bits() -> None:
    """The same tracks come to the same file in another process."""
    code = (
        "import hashlib; from tests.filters.test_diffusion import LEARNED;"
        "print(hashlib.sha256(LEARNED.text.encode()).hexdigest())"
    )
    root = Path(__file__).parents[2]
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, cwd=root)
    assert done.stdout.strip() == hashlib.sha256(LEARNED.text.encode()).hexdigest()


def test_lost_stretches_are_left_out() -> None:
    """A track with a gap teaches what its parts teach."""
    broken = np.vstack([TRACKS[0], np.full((1, 4), np.nan), TRACKS[1]])
    parts, whole = learn(TRACKS[:2], FISH, "fish"), learn([broken], FISH, "fish")
    assert whole.spreads == parts.spreads
    assert (whole.tracks, whole.frames) == (1, 120)


@pytest.mark.parametrize(
    ("tracks", "words"),
    [
        ([], "at least 20 frames with two frames known before them, got 0 in 0 tracks"),
        ([TRACKS[0][:21]], "got 19 in 1 track; learn from longer runs, or from more of them"),
        ([np.full((100, 4), np.nan)], "got 0 in 0 tracks"),
        ([TRACKS[0] * [1, 1, 1, 0]], "'phi' never changes in it, so no particle would ever change it either"),
        ([TRACKS[0] * [1e9, 1, 1, 1]], "at most 1e.06 px/frame² as a'', got"),
    ],
)
def test_tracks_that_teach_nothing_are_refused(tracks: list[NDArray[np.float64]], words: str) -> None:
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


def altered(change: Callable[[Any], object]) -> str:
    raw = json.loads(LEARNED.text)
    change(raw)
    return json.dumps(raw)


def spread(raw: dict[str, Any]) -> list[list[float]]:
    covariance: list[list[float]] = raw["spreads"][0]["covariance"]
    return covariance


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "it is not JSON"),
        ("no", "it is not JSON"),
        (LEARNED.text[:700], "it was cut short"),
        ("[" * 100_000, "it is not the JSON"),
        ("[]", "it is not a learned motion, as `pftrack learn` writes it"),
        ('{"points": []}', "it is not a learned motion, as `pftrack learn` writes it"),
        (altered(lambda raw: raw.update(version=2)), "it has format 2, and this version of pftrack reads 1"),
        (altered(lambda raw: raw.update(experiment="ball")), "it was learned in 'ball', and this is 'fish'"),
        (altered(lambda raw: raw.pop("spreads")), "spreads: field required"),
        (altered(lambda raw: raw.update(more=1)), "more: extra inputs"),
        (altered(lambda raw: raw.update(tracks=0)), "tracks: input should be greater"),
        (altered(lambda raw: raw["chart"].update(heading="psi")), r"learned of a \(px\), b \(px\), psi \(rad\), phi"),
        (altered(lambda raw: raw["chart"].update(unit="mm")), r"learned of a \(mm\), .* and fish has a \(px\)"),
        (altered(lambda raw: raw["step_sd"].pop()), "expected 4 numbers as step_sd, got 3"),
        (altered(lambda raw: raw["spreads"].pop()), "spreads of the readings document, increments"),
        (altered(lambda raw: spread(raw).pop()), "4 means and 4 x 4 covariances"),
        (altered(lambda raw: spread(raw)[0].__setitem__(0, -1.0)), "a variance of -1 of a''"),
        (altered(lambda raw: spread(raw)[3].__setitem__(3, 0.0)), "'phi' never changes in it"),
        (altered(lambda raw: spread(raw)[0].__setitem__(0, 1e300)), "less than or equal to"),
        (altered(lambda raw: spread(raw)[0].__setitem__(0, float("nan"))), "spreads.0.covariance.0.0: input should be"),
        (altered(lambda raw: spread(raw)[0].__setitem__(1, 9.0)), "a symmetric covariance"),
        (
            altered(lambda raw: (spread(raw)[0].__setitem__(1, 9.0), spread(raw)[1].__setitem__(0, 9.0))),
            "a variance below 0",
        ),
    ],
)
def test_files_that_do_not_fit_are_refused(text: str, words: str) -> None:
    """A file that is none, of another experiment, chart or version, or no covariance, is refused with one sentence."""
    with pytest.raises(RefusedError, match=words):
        Learned.read(text, experiment="fish", chart=FISH)


@given(st.integers(0, len(LEARNED.text)), st.text(max_size=3))
def test_no_damaged_file_does_more_than_be_refused(place: int, scrap: str) -> None:
    """A file that was cut or written into is read as a learned motion or refused, and raises nothing else."""
    for text in (LEARNED.text[:place], LEARNED.text[:place] + scrap + LEARNED.text[place + 1 :]):
        with suppress(RefusedError):
            assert Learned.read(text, experiment="fish", chart=FISH).experiment == "fish"
