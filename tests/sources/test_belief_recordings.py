"""Recordings of beliefs: what a loop says is there to the number, whatever becomes of the loop."""

import zipfile
from contextlib import suppress
from pathlib import Path

import numpy as np
import pytest

import pftrack
from pftrack.analysis.other_seeds import ensemble
from pftrack.core.refusal import RefusedError
from pftrack.sources.beliefs import content
from pftrack.sources.beliefs.content import header_of
from pftrack.sources.sequence import open_sequence
from pftrack.vision.film import FilmWriter
from tests.sources.films import refused, rows_of

FRAMES, COUNT = 6, 50


def particles_of(frame: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    rng = np.random.default_rng(frame)
    states = rng.standard_normal((COUNT, 3)) + np.array([10.0 * frame, -5.0, 2.0])
    return states, rng.standard_normal(COUNT), np.sort(rng.integers(0, COUNT, COUNT))


def record(path: Path, frames: int = FRAMES, **options: object) -> Path:
    with pftrack.record(path, **options) as rec:
        for t in range(frames):
            states, weights, ancestors = particles_of(t)
            rec(t, particles=states, log_weights=weights, ancestors=ancestors, truth=(10.0 * t, -5.0))
    return path


def test_a_loop_opens_as_a_run(tmp_path: Path) -> None:
    """The estimate is the weighted mean, and ESS, different parents and errors are those of the loop's numbers."""
    rows = rows_of(record(tmp_path / "mine.pft", precision="double"))
    assert len(rows) == FRAMES
    for t, row in enumerate(rows):
        states, weights, ancestors = particles_of(t)
        share = np.exp(weights) / np.exp(weights).sum()
        assert row.estimate == pytest.approx(share @ states[:, :2])
        assert row.number("ess") == pytest.approx(1 / np.square(share).sum())
        assert row.number("unique_ancestors") == len(set(ancestors.tolist()))
        assert row.error == pytest.approx(np.hypot(*(share @ states[:, :2] - (10.0 * t, -5.0))))
        assert row.sigma == pytest.approx(np.sqrt(share @ np.square(states[:, :2] - share @ states[:, :2])))


TURN = np.array([(0.5 * t, 0.5) if t < 40 else (20.0 - 1.5 * (t - 40), -1.5) for t in range(80)])


def record_turn(path: Path) -> Path:
    """A filter of 300 particles that expects no turn follows a target that turns back after half of 80 frames."""
    rng = np.random.default_rng(1)
    states, ancestors = rng.normal(size=(300, 2)) * [0.5, 0.05] + [0.0, 0.5], np.arange(300)
    with pftrack.record(path, components=("x", "vx")) as rec:
        for t, truth in enumerate(TURN):
            states[:, 0] += states[:, 1] + 0.02 * rng.normal(size=300)
            log_weights = -0.5 * np.square((states[:, 0] - truth[0]) / 0.5)
            rec(t, particles=states, log_weights=log_weights, ancestors=ancestors, truth=truth)
            weights = np.exp(log_weights - log_weights.max())
            ancestors = rng.choice(300, 300, p=weights / weights.sum())
            states = states[ancestors]
    return path


def test_a_loop_that_lost_its_target_is_told_why_and_that_nothing_can_be_tried(tmp_path: Path) -> None:
    """The law of motion is named from what was recorded; of the likelihood, which was not, nothing is said.

    Where truths have no box the limit is their root mean square distance from their middle; a box says it better.
    """
    run = pftrack.load(record_turn(tmp_path / "turn.pft"))
    run.finish()
    limit = run.parameters_at(0).lost_distance
    assert limit == pytest.approx(np.sqrt(TURN.var(axis=0).sum()), rel=5e-3)  # it has three digits
    assert [row.lost for row in run.diagnostics] == [row.error >= limit for row in run.diagnostics]
    explanation = run.explain(seeds=2)
    assert (explanation.diagnosis.cause, explanation.what_if) == ("wrong-dynamics", None)
    assert "fit" not in " ".join(sign.words for sign in explanation.diagnosis.signs)
    assert explanation.lines[-1].startswith("What would have saved it cannot be tried: ")
    assert "shown as it was recorded" in explanation._repr_html_()
    with pytest.raises(RefusedError):
        ensemble(run, runs=2)
    with pftrack.record(tmp_path / "box.pft") as rec:
        for t in range(3):
            rec(t, box=(t, 0, 10, 10), true_box=(2 * t, 0, 10, 10))
    assert pftrack.load(tmp_path / "box.pft").parameters_at(0).lost_distance == 0


def test_the_paper_has_room_for_the_truth(tmp_path: Path) -> None:
    """Where a loop has lost its target, both are to be seen: what it believes, and where the target is."""
    with pftrack.record(tmp_path / "far.pft", components=("x", "y", "z")) as rec:
        for t in range(9):
            rec(t, mean=(0.1 * t, 0.0, 1.0), truth=(50.0 * t, -3.0))
    sequence = open_sequence(tmp_path / "far.pft")
    plane = sequence.plane((0, 1))
    for place in ((0.0, 0.0), (400.0, -3.0)):
        drawn = np.array(plane.scale) * place + plane.shift
        assert np.all((drawn > 0) & (drawn < sequence.size))


def test_single_precision_is_enough_for_what_is_seen(tmp_path: Path) -> None:
    """Half the bytes are written if not asked otherwise, and the estimate differs in the seventh digit at most."""
    single, double = record(tmp_path / "one.pft"), record(tmp_path / "two.pft", precision="double")
    assert single.stat().st_size < 0.75 * double.stat().st_size
    one, two = (np.array(rows_of(path)[-1].estimate) for path in (single, double))
    assert one == pytest.approx(two, rel=1e-6)


def test_gaussians_and_boxes_are_beliefs(tmp_path: Path) -> None:
    """Means with covariances, and boxes of several targets, are shown as what they are."""
    with pftrack.record(tmp_path / "gaussians.pft") as rec:
        for t in range(4):
            rec(t, mean=[t, 2.0], covariance=np.diag([4.0, 9.0]))
    row = rows_of(tmp_path / "gaussians.pft")[-1]
    assert (row.estimate, row.sigma) == ((3.0, 2.0), (2.0, 3.0))
    with pftrack.record(tmp_path / "boxes.pft") as rec:
        for t in range(4):
            rec(t, box=(10 + t, 20, 31, 41), target=5, true_box=(10 + t, 20, 31, 41))
            rec(t, box=(90, 20, 5, 5), target=6)
    row = rows_of(tmp_path / "boxes.pft")[-1]
    assert row.estimate == (28.0, 40.0)  # the middle of whole pixels
    assert (row.number("overlap"), row.number("targets")) == (1.0, 2.0)


def test_numbers_that_change_are_counted_where_they_do(tmp_path: Path) -> None:
    """Where two targets take each other's number, both switch, and the selected one is lost from there on."""
    with pftrack.record(tmp_path / "two.pft") as rec:
        for t in range(8):
            for true in (1, 2):
                box = (100 * true, 50, 20, 20)
                rec(t, box=box, target=true if t < 5 else 3 - true)
                rec.truth(t, box=box, target=true)
    rows = rows_of(tmp_path / "two.pft")
    assert [row.number("identity_switches") for row in rows] == [0, 0, 0, 0, 0, 2, 0, 0]
    assert [bool(row.lost) for row in rows] == [False] * 5 + [True] * 3


def test_a_target_that_is_gone_is_where_it_was_seen_last(tmp_path: Path) -> None:
    """A frame of which nothing is said repeats the last belief, and says that the target is looked for."""
    with pftrack.record(tmp_path / "gaps.pft", np.arange(6) / 10.0) as rec:
        for t in (1, 2, 5):
            rec(t, mean=[float(t), 0.0])
    run = pftrack.load(tmp_path / "gaps.pft")
    run.finish()
    assert [row.estimate[0] for row in run.diagnostics] == [1, 1, 2, 2, 2, 5]
    assert [row.searching for row in run.diagnostics] == [True, False, False, True, True, False]
    assert run.source.frame_rate_hz == pytest.approx(10.0)


def test_a_clip_goes_along(tmp_path: Path) -> None:
    """The pictures of a recording are those of its clip, to the bit, and the clip is needed no more."""
    clip = write_clip(tmp_path / "clip.mp4")
    pictures = [open_sequence(clip).picture(t) for t in range(FRAMES)]
    path = record(tmp_path / "mine.pft", source=clip)
    clip.unlink()
    sequence = open_sequence(path)
    again = open_sequence(path, index=sequence.index)
    assert (sequence.index.kind, sequence.size, again.index) == ("beliefs", (64, 48), sequence.index)
    for seen, t in ((sequence, 3), (sequence, 0), (sequence, 5), (again, 4)):
        assert np.array_equal(seen.picture(t), pictures[t])


def test_pictures_can_be_given_one_by_one(tmp_path: Path) -> None:
    """Arrays of pixels are the pictures of the frames of which something is said."""
    pictures = np.random.default_rng(0).integers(0, 255, (FRAMES, 1, 1, 3)).repeat(32, 1).repeat(48, 2).astype(np.uint8)
    sequence = open_sequence(record(tmp_path / "mine.pft", source=pictures))
    assert sequence.size == (48, 32)
    assert np.abs(sequence.picture(2).astype(int) - pictures[2]).max() < 12


def test_what_was_said_before_a_loop_broke_off_is_there(tmp_path: Path) -> None:
    """A file without its end, or cut in the middle of a frame, holds what came before."""
    with zipfile.ZipFile(record(tmp_path / "mine.pft")) as archive:
        assert archive.testzip() is None
    path = tmp_path / "cut.pft"
    rec = pftrack.record(path)
    for t in range(3):
        rec(t, particles=particles_of(t)[0])
        rec._hand_on()
    rec.close()
    data = path.read_bytes()
    path.write_bytes(data[: data.rindex(b"chunks/000002/rows.npy", 0, data.index(b"PK\x01\x02")) + 40])
    assert open_sequence(path).frame_count == 2


def test_a_recording_has_bounds(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """What would take too much memory is refused with the bound."""
    path = record(tmp_path / "mine.pft")
    monkeypatch.setattr(content, "MOST_PARTICLES", COUNT - 1)
    refused(path, f"more than the {COUNT - 1} particles")
    monkeypatch.setattr(content, "MOST_ROWS", 3)
    refused(path, "more than the 3 times")


def test_what_does_not_fit_is_refused_at_once(tmp_path: Path) -> None:
    """Shapes are checked when they are said, with what was expected.

    A frame before the last of its target is refused; other targets and truths have their own order.
    """
    with pftrack.record(tmp_path / "mine.pft", components=("x", "y")) as rec:
        for said, sentence in (
            ({"particles": np.zeros((3, 2)), "log_weights": np.zeros(2)}, "log_weights must be"),
            ({"particles": np.zeros((3, 4))}, "particles must be"),
            ({"box": (0, 0, -1, 2)}, "box must be"),
            ({}, "has no belief"),
            ({"particles": np.array([[0.0, 1.0], [np.nan, 2.0]])}, "particles must be finite, got NaN or infinity"),
            ({"mean": [np.inf, 0.0]}, "mean must be finite, got NaN or infinity"),
            ({"mean": [0.0, 0.0], "covariance": np.full((2, 2), np.nan)}, "covariance must be finite"),
        ):
            with pytest.raises(ValueError, match=sentence):
                rec(0, **said)
        rec(5, mean=[0.0, 0.0])
        with pytest.raises(ValueError, match="frames of a target must rise, got 3 of target 0 after 5"):
            rec(3, mean=[0.0, 0.0])
        rec(3, mean=[0.0, 0.0], target=1)
        rec.truth(2, position=[0.0, 0.0])


def test_damage_is_refused_in_a_sentence(tmp_path: Path) -> None:
    """Bytes that were changed give a sentence, whatever they are."""
    data = record(tmp_path / "mine.pft").read_bytes()
    rng = np.random.default_rng(1)
    for place in rng.integers(0, len(data), 60):
        path = tmp_path / "damaged.pft"
        path.write_bytes(data[:place] + bytes([data[place] ^ 0xFF]) + data[place + 1 :])
        with suppress(RefusedError):
            sequence = open_sequence(path)
            sequence.content.belief(sequence.content.first, 0)


@pytest.mark.parametrize("source", [[0.0], [np.zeros((16, 16, 3), np.uint8)]])
def test_the_clock_may_be_before_1980(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, source: list[object]) -> None:
    """A recording takes no time from the clock, which an archive could not hold."""
    monkeypatch.setattr("time.time", lambda: 0.0)
    assert open_sequence(record(tmp_path / "mine.pft", 1, source=source)).frame_count == 1


ROW = (0, 0, 0, 3, 0, 0, 0, 0, 0)
DESCRIPTION = b'{"version": %s, "components": [], "frame_rate_hz": 30, "clip": null, "remarks": []}'


@pytest.mark.parametrize(
    ("entries", "words"),
    [
        ({"chunks/000000/particles.npy": np.zeros((3, 0))}, "must have the same 1 to 400 components"),
        ({"chunks/000000/rows.npy": np.array([ROW], "<f8")}, "its rows cannot be read"),
        ({"chunks/000000/rows.npy": np.array([[*ROW[:4], 2, 0, 0, 0, 0]])}, "its rows cannot be read"),
        ({"chunks/000000/rows.npy": b"\x93NUMPY\x01\x00\x04\x00(((("}, "an entry is not an array"),
        ({"chunks/000000/log_weights.npy": header_of(np.dtype("<f8"), ())}, "the length of an array differs"),
        ({"times.npy": np.zeros(0)}, "its times do not rise"),
        ({"times.npy": np.array([0.0, 5e-324])}, "its times do not rise"),
        ({"recording.json": DESCRIPTION % b"Infinity"}, "its description cannot be read"),
        ({"pictures/²²²²²².jpg": b"\xff\xd8\xff", "pictures/1.jpg": b"\xff\xd8\xff"}, None),
    ],
)
def test_what_no_recorder_writes_is_refused(
    tmp_path: Path, entries: dict[str, bytes | np.ndarray], words: str | None
) -> None:
    """An archive of other arrays, numbers and digits gives a sentence of the reader's; unknown entries do no harm."""
    whole = {
        "recording.json": DESCRIPTION % b"1",
        "chunks/000000/rows.npy": np.array([ROW]),
        "chunks/000000/particles.npy": np.zeros((3, 2)),
    }
    with zipfile.ZipFile(tmp_path / "mine.pft", "w", zipfile.ZIP_STORED) as archive:
        for name, value in (whole | entries).items():
            data = value if isinstance(value, bytes) else header_of(value.dtype, value.shape) + value.tobytes()
            archive.writestr(name, data)
    if words is None:
        open_sequence(tmp_path / "mine.pft").close()
    else:
        refused(tmp_path / "mine.pft", words)


def test_a_clip_may_be_a_file_of_its_own(tmp_path: Path) -> None:
    """It is known by its content: beside the recording or where one says; that it is absent or another one is told."""
    clip = write_clip(tmp_path / "clip.mp4")
    path = record(tmp_path / "mine.pft", source=clip, embed=False)
    assert path.stat().st_size < 20_000
    sequence = open_sequence(path)
    assert (sequence.size, sequence.index.warnings) == ((64, 48), ())
    assert np.array_equal(sequence.picture(3), open_sequence(clip).picture(3))
    elsewhere = clip.rename(tmp_path / "other.mp4")
    alone = open_sequence(path)
    (said,) = alone.index.warnings
    assert said.startswith("Its clip, clip.mp4, is not here")
    assert alone.frame_count == FRAMES
    assert pftrack.load(path, recording=elsewhere).source.size == (64, 48)
    write_clip(clip, shade=39)
    assert "is another clip than its own" in open_sequence(path).index.warnings[0]
    with pytest.raises(RefusedError, match=r"the clip is not clip\.mp4"):
        pftrack.load(path, recording=clip)


def write_clip(path: Path, shade: int = 40) -> Path:
    with FilmWriter(path, 25.0) as film:
        for t in range(FRAMES):
            film.write(np.full((48, 64, 3), shade * t, dtype=np.uint8))
    return path


def test_units_are_those_of_the_loop(tmp_path: Path) -> None:
    """They stand at the plots of the chosen components, and at the error where both have the same."""
    path = record(tmp_path / "mine.pft", units=("m", "m", "m/s"))
    for run, expected in (
        (pftrack.load(path), ("m", "m", "m")),
        (pftrack.run("recorded", recording=path, component_down=2), ("", "m", "m/s")),
    ):
        units = {plot.id: plot.unit for plot in run.experiment.display.plots}
        assert (run.experiment.judge.unit, units["across"], units["down"]) == expected
    with pftrack.record(tmp_path / "one.pft", units=("m",)) as rec:
        rec(0, particles=np.arange(3.0))
    assert pftrack.load(tmp_path / "one.pft").experiment.judge.unit == "m"
    assert pftrack.load(record(tmp_path / "none.pft")).experiment.judge.unit == ""
    seen = record(tmp_path / "seen.pft", source=write_clip(tmp_path / "clip.mp4"))
    assert pftrack.load(seen).experiment.judge.unit == "px"
