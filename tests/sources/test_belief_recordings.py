"""Recordings of beliefs hold what a loop records to the number, even if the loop breaks off."""

import zipfile
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

import pftrack
from pftrack.analysis.other_seeds import ensemble
from pftrack.core.model.tracker import Diagnostics
from pftrack.core.refusal import RefusedError
from pftrack.sources.beliefs import content
from pftrack.sources.beliefs.content import header_of
from pftrack.sources.beliefs.recorder import ParticlesCollector, record_filterpy, record_pfilter, record_stone_soup
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
    """The estimate is the weighted mean, and ESS, different parents and errors are those of the loop's numbers.

    The default precision needs about half the bytes, and changes the estimate by the seventh digit at most.
    """
    double, single = record(tmp_path / "mine.pft", precision="double"), record(tmp_path / "one.pft")
    rows = rows_of(double)
    assert single.stat().st_size < 0.75 * double.stat().st_size
    assert rows_of(single)[-1].estimate == pytest.approx(rows[-1].estimate, rel=1e-6)
    for t, row in zip(range(FRAMES), rows, strict=True):
        states, weights, ancestors = particles_of(t)
        share = np.exp(weights) / np.exp(weights).sum()
        assert row.estimate == pytest.approx(share @ states[:, :2])
        assert row.number("ess") == pytest.approx(1 / np.square(share).sum())
        assert row.number("unique_ancestors") == len(set(ancestors.tolist()))
        assert row.error == pytest.approx(np.hypot(*(share @ states[:, :2] - (10.0 * t, -5.0))))
        assert row.sigma == pytest.approx(np.sqrt(share @ np.square(states[:, :2] - share @ states[:, :2])))


def test_a_loss_is_explained_but_nothing_can_be_tried(tmp_path: Path) -> None:
    """Where truths have no box the limit is their root mean square distance from their middle; a box has its edges."""
    truth = np.array([(t, 0.5 * t) for t in range(30)])
    with pftrack.record(tmp_path / "lost.pft") as rec:
        for t, place in enumerate(truth):
            rec(t, mean=[0.0, 0.0], covariance=np.eye(2), truth=place)
    run = pftrack.load(tmp_path / "lost.pft")
    run.finish()
    limit = run.parameters_at(0).lost_distance
    assert limit == pytest.approx(np.sqrt(truth.var(axis=0).sum()), rel=5e-3)  # it has three digits
    assert [row.lost for row in run.diagnostics] == [row.error >= limit for row in run.diagnostics]
    explanation = run.explain(seeds=2)
    assert explanation.what_if is None
    assert explanation.lines[-1].startswith("What would have saved it cannot be tried: ")
    with pytest.raises(RefusedError):
        ensemble(run, runs=2)
    with pftrack.record(tmp_path / "box.pft") as rec:
        for t in range(3):
            rec(t, box=(t, 0, 10, 10), true_box=(2 * t, 0, 10, 10))
    assert pftrack.load(tmp_path / "box.pft").parameters_at(0).lost_distance == 0


def test_the_paper_has_room_for_the_truth(tmp_path: Path) -> None:
    """Where a loop has lost its target, the picture shows both the belief and the target."""
    with pftrack.record(tmp_path / "far.pft", components=("x", "y", "z")) as rec:
        for t in range(9):
            rec(t, mean=(0.1 * t, 0.0, 1.0), truth=(50.0 * t, -3.0))
    sequence = open_sequence(tmp_path / "far.pft")
    plane = sequence.plane((0, 1))
    for place in ((0.0, 0.0), (400.0, -3.0)):
        drawn = np.array(plane.scale) * place + plane.shift
        assert np.all((drawn > 0) & (drawn < sequence.size))


def test_boxes_are_beliefs(tmp_path: Path) -> None:
    """Boxes of several targets have the middle of the first, and its overlap with the true box."""
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
    """A frame without a belief repeats the last one, and reports that the target is searched for."""
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


def test_pictures_can_be_given_one_by_one(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Arrays of pixels are the pictures; no time comes from the clock, since an archive cannot hold every time."""
    monkeypatch.setattr("time.time", lambda: 0.0)
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
    for place in rng.integers(0, len(data), 20):
        path = tmp_path / "damaged.pft"
        path.write_bytes(data[:place] + bytes([data[place] ^ 0xFF]) + data[place + 1 :])
        with suppress(RefusedError):
            sequence = open_sequence(path)
            sequence.content.belief(sequence.content.first, 0)


ROW = (0, 0, 0, 3, 0, 0, 0, 0, 0)
DESCRIPTION = b'{"version": %s, "components": [], "frame_rate_hz": 30, "clip": null, "remarks": []}'


@pytest.mark.parametrize(
    ("entries", "words"),
    [
        ({"chunks/000000/particles.npy": np.zeros((3, 0))}, "must have the same 1 to 400 components"),
        ({"chunks/000000/rows.npy": np.array([ROW], "<f8")}, "its rows cannot be read"),
        ({"chunks/000000/rows.npy": b"\x93NUMPY\x01\x00\x04\x00(((("}, "an entry is not an array"),
        ({"chunks/000000/log_weights.npy": header_of(np.dtype("<f8"), ())}, "the length of an array differs"),
        ({"times.npy": np.array([0.0, 5e-324])}, "its times do not rise"),
        ({"recording.json": DESCRIPTION % b"Infinity"}, "its description cannot be read"),
        ({"pictures/²²²²²².jpg": b"\xff\xd8\xff", "pictures/1.jpg": b"\xff\xd8\xff"}, None),
    ],
)
def test_what_no_recorder_writes_is_refused(tmp_path: Path, entries: dict[str, object], words: str | None) -> None:
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
    """It is found by its content, beside the recording or at a path; one that is missing or another is reported."""
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
    """Plots show the units of the chosen components; the error has a unit if both are the same."""
    path = record(tmp_path / "mine.pft", units=("m", "m", "m/s"))
    run = pftrack.run("recorded", recording=path, component_down=2)
    units = {plot.id: plot.unit for plot in run.experiment.display.plots}
    assert (run.experiment.judge.unit, units["across"], units["down"]) == ("", "m", "m/s")
    assert pftrack.load(path).experiment.judge.unit == "m"
    assert pftrack.load(record(tmp_path / "none.pft")).experiment.judge.unit == ""
    seen = record(tmp_path / "seen.pft", source=write_clip(tmp_path / "clip.mp4"))
    assert pftrack.load(seen).experiment.judge.unit == "px"


# Adapters record what a filter of another library holds; stand-ins have the attributes that these libraries have.


def test_adapters_record_what_a_filter_holds(tmp_path: Path) -> None:
    """Particles with weights and ancestors, Gaussians, and tracks, which are numbered in order of appearance."""
    states, log_weights, parents = particles_of(0)
    weights = np.exp(log_weights) / np.exp(log_weights).sum()
    gaussian = SimpleNamespace(mean=np.array([[1.0], [2.0]]), covar=np.diag([4.0, 9.0]))
    tracks = [SimpleNamespace(id=name, state=gaussian) for name in "ab"]

    def recorded(adapter: Callable[..., None], held: object) -> Diagnostics:
        with pftrack.record(tmp_path / "mine.pft", precision="double") as rec:
            adapter(rec, 0, held)
        return rows_of(tmp_path / "mine.pft")[0]

    rows = [
        recorded(record_pfilter, SimpleNamespace(original_particles=states, original_weights=weights)),
        recorded(record_stone_soup, SimpleNamespace(state_vector=states.T, log_weight=log_weights)),
        recorded(
            lambda rec, _, held: ParticlesCollector(rec)().collect(held),
            SimpleNamespace(X=states, wgts=SimpleNamespace(lw=log_weights), A=parents),
        ),
    ]
    for row in rows:
        assert row.estimate == pytest.approx(weights @ states[:, :2])
        assert row.number("ess") == pytest.approx(1 / np.square(weights).sum())
    assert rows[2].number("unique_ancestors") == len(set(parents.tolist()))
    row = recorded(record_filterpy, SimpleNamespace(x=gaussian.mean, P=gaussian.covar))
    assert (row.estimate, row.sigma) == ((1.0, 2.0), (2.0, 3.0))
    row = recorded(record_stone_soup, tracks)
    assert (row.estimate, row.number("targets")) == ((1.0, 2.0), 2)
