"""Saved runs: the same numbers from files of today and of long ago, and a clear word for every file that is none."""

import io
import json
import zipfile
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from pftrack.core.model.marks import Box
from pftrack.core.model.recipe import Change, Footage, Recipe
from pftrack.core.model.source import FrameSequence
from pftrack.core.numerics import machine
from pftrack.core.numerics.random import LARGEST_SEED
from pftrack.core.refusal import ParameterError, RefusedError
from pftrack.experiments import EXPERIMENTS, find
from pftrack.experiments.own.code import trust
from pftrack.runs import record
from pftrack.runs.record import Saved, read, read_saved, save
from pftrack.runs.reproduction import departure, difference, load, make
from pftrack.runs.run import Run
from pftrack.runs.table import clouds_of
from pftrack.sources.sequence import open_sequence
from pftrack_server.sessions.create import SessionCreate
from pftrack_server.sessions.spec import BranchSpec, RunSnapshot, SessionSpec
from tests.experiments.head.heads import Pictures, pictures
from tests.making import whole_run
from tests.sources.films import lossless

BALL = find("ball")
CHANGES = (Change(0, {"sample_count": 150}), Change(12, {"occlusion_width_px": 80, "tracker": "s-spf"}))


@pytest.fixture(scope="module")
def whole() -> Run:
    return whole_run(BALL, seed=9, frames=30, timeline=CHANGES)


@pytest.fixture
def run(whole: Run) -> Run:
    """The run at its end, from which a test may seek."""
    whole.seek(whole.computed)
    return whole


@pytest.fixture
def path(run: Run, tmp_path: Path) -> Path:
    """Its file."""
    save(run, tmp_path / "a.pft")
    return tmp_path / "a.pft"


def _rewritten(path: Path, **changes: object) -> Path:
    with zipfile.ZipFile(path) as archive:
        raw = json.loads(archive.read("run.json"))
    with zipfile.ZipFile(path, "w") as archive:
        for name, value in changes.items():
            (raw if name in raw else raw["recipe"])[name] = value
        archive.writestr("run.json", json.dumps(raw))
    return path


def test_a_saved_run_keeps_the_defaults_that_it_had(run: Run, path: Path, tmp_path: Path) -> None:
    """Where a default was another one when the run was saved, it counts; what was chosen counts more."""
    defaults, today = read(path).recipe.defaults, run.parameters_at(0)
    assert defaults["gamma_px"] == today.gamma_px
    assert "sample_count" not in defaults
    assert load(path).timeline == run.timeline
    older = {**defaults, "gamma_px": 7.5, "sample_count": 9, "given_up": 3}
    again = load(_rewritten(path, defaults=older))
    first = again.parameters_at(0)
    assert (first.gamma_px, first.sample_count, first.ball_radius_px) == (7.5, 150, today.ball_radius_px)
    assert again.recipe.timeline[0].values == {"gamma_px": 7.5, "sample_count": 150}
    assert again.parameters_at(12).gamma_px == 7.5
    save(Run(BALL, BALL.simulate(), seed=9, frames=30, timeline=CHANGES[1:]), tmp_path / "b.pft")
    assert load(_rewritten(tmp_path / "b.pft", defaults={"gamma_px": 7.5})).parameters_at(0).gamma_px == 7.5


def test_diagnostics_and_states_come_along(run: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The file holds every frame's numbers and, on request, every frame's particles, and takes no time from a clock."""
    monkeypatch.setattr("time.time", lambda: 0.0)  # before 1980, which an archive could not hold
    run.seek(4)
    save(run, tmp_path / "a.pft", states=True)
    with zipfile.ZipFile(tmp_path / "a.pft") as archive:
        columns, states = (dict(np.load(archive.open(f"{name}.npz"))) for name in ("diagnostics", "states"))
        assert archive.getinfo("states.npz").compress_type == zipfile.ZIP_STORED  # compressed within, and only there
        assert {entry.date_time for entry in archive.infolist()} == {(1980, 1, 1, 0, 0, 0)}
    assert columns["estimate"].tolist() == [list(row.estimate) for row in run.diagnostics]
    assert columns["series_samples"].tolist() == [list(row.vector("samples") or ()) for row in run.diagnostics]
    assert np.array_equal(states["states_20"], run.seek(20).state.particles.states)
    assert run.position == 20
    clouds = clouds_of(run)
    assert all(np.array_equal(states[name], clouds[name], equal_nan=True) for name in clouds)
    cloud = run.experiment.trackers[run.tracker].cloud(run.seek(20).state)
    assert np.array_equal(clouds["cloud"][20], cloud.states)
    assert clouds["cloud_ancestors"][20].tolist() == np.asarray(cloud.ancestors).tolist()


def test_a_damaged_archive_is_told_from_a_whole_one(path: Path) -> None:
    """Damaged numbers leave a run whole, since they can be computed again.

    A file with a damaged description, a foreign one, one that is cut short and a missing one are refused.
    """
    for member in ("diagnostics.npz", "run.json"):
        with zipfile.ZipFile(path) as archive:
            start = archive.getinfo(member).header_offset + 30 + len(member)
        data = path.read_bytes()
        path.write_bytes(data[:start] + bytes([0xFF]) * 40 + data[start + 40 :])
        if member == "diagnostics.npz":
            assert read_saved(path).record == read(path)
            assert read_saved(path).estimates is None
    with zipfile.ZipFile(foreign := io.BytesIO(), "w") as archive:
        archive.writestr("other.json", "{}")
    for content in (path.read_bytes(), path.read_bytes()[:400], b"hello", foreign.getvalue()):
        path.write_bytes(content)
        with pytest.raises(RefusedError, match=r"a\.pft is not a saved run, or was cut short"):
            read(path)
    path.unlink()
    with pytest.raises(RefusedError, match="does not exist"):
        read(path)


def test_what_unpacks_to_too_much_is_not_read(path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A small archive may hold a thousand times as much; a run without numbers can be computed again all the same."""
    monkeypatch.setattr(record, "LARGEST_DIAGNOSTICS_BYTES", 20_000)
    packed = io.BytesIO()
    assert read_saved(path).estimates is not None
    np.savez_compressed(packed, estimate=np.zeros((10_000, 2)))
    assert len(packed.getvalue()) < 20_000
    with zipfile.ZipFile(_rewritten(path), "a") as archive:
        archive.writestr("diagnostics.npz", packed.getvalue())
    assert read_saved(path).estimates is None
    monkeypatch.setattr(record, "LARGEST_RECORD_BYTES", 10)
    with pytest.raises(RefusedError, match=r"a\.pft is not a saved run: its description is larger"):
        read(path)


@pytest.mark.parametrize(
    ("changes", "word"),
    [
        ({"version": 3}, "format 3"),
        ({"version": "x"}, "version is missing or wrong"),
        ({"computed": 0}, "computed is missing or wrong"),
        ({"experiment": "cards"}, "got 'cards'"),
        ({"timeline": [{"frame": 0, "values": {"colour_of_magic": 8}}]}, "colour_of_magic"),
        ({"timeline": [{"frame": 3, "values": {"sample_count": 0}}]}, "between 1 and"),
        ({"footage": {"name": "clip.mp4"}}, "clip.mp4"),
        ({"footage": {"reference": "clip.mp4"}}, "footage"),
    ],
)
def test_wrong_descriptions_are_refused(path: Path, changes: dict[str, object], word: str) -> None:
    """A description that does not fit is refused with what does not fit."""
    with pytest.raises(RefusedError, match=word):
        load(_rewritten(path, **changes))


@pytest.mark.parametrize("row", [[1, 2, float("nan"), 4], [1, 2, 1e300, 4], [1, 2, 3], [1, 2, 0, 4]])
def test_a_truth_that_no_file_could_give_is_refused(tmp_path: Path, row: list[float]) -> None:
    """The truth in a saved run is held to what is asked of a table."""
    truth = BALL.video.truth.table({0: (1, 2, 30, 40)})
    setup = BALL.video.on_video(Pictures(pictures(2, width=160)), Box.of(1, 2, 30, 40), truth=truth)
    save(Run(BALL, setup), tmp_path / "a.pft")
    footage = read(tmp_path / "a.pft").recipe.as_dict()["footage"]
    path = _rewritten(tmp_path / "a.pft", footage={**footage, "truth": {"0": row}})
    with pytest.raises(RefusedError, match=r"truth\.0"):
        load(path, open_sequence=lambda _: Pictures(pictures(2, width=160)))


def test_a_run_on_oblong_pixels_says_that_they_were_made_square(tmp_path: Path) -> None:
    """A run of today is made again on square ones, also where the recording was indexed by an earlier version."""
    shown = np.full((4, 90, 80, 3), 180, np.uint8)
    for number, picture in enumerate(shown):
        picture[33:57, 24 + number : 36 + number] = (208, 32, 32)
    clip = lossless(tmp_path / "oblong.mkv", shown, "2/1")
    today = Run(BALL, BALL.video.on_video(open_sequence(clip), Box(x=48, y=33, width=24, height=24)), seed=2)
    today.finish()
    save(today, tmp_path / "today.pft")
    assert read(tmp_path / "today.pft").recipe.footage.square is True
    stored = open_sequence(clip, square=False).index
    again = load(tmp_path / "today.pft", open_sequence=lambda it: open_sequence(clip, index=stored, square=it.square))
    assert again.source.size == (160, 90)
    again.finish()
    assert again.estimates_sha256 == today.estimates_sha256


# Runs that were saved long ago: computed again from their recipes, they have the same bits.

RUNS = Path(__file__).parents[1] / "data" / "runs"


@pytest.mark.parametrize("name", EXPERIMENTS)
def test_an_old_run_has_the_same_hash(name: str) -> None:
    """The recipe alone gives the estimates of every frame again; every experiment has an old run."""
    saved, again = read(RUNS / f"{name}.pft"), load(RUNS / f"{name}.pft")
    again.seek(saved.computed - 1)
    assert again.estimates_sha256 == saved.estimates_sha256


# Recipes: one JSON form, which is whole wherever a run is kept, and refused by field.

TEXT = "def should_resample(log_weights):\n    return True\n"

WRONG = ("", "../../../Downloads/evil", "A" * 64, "a" * 63, "a" * 64 + "\n", "/" + "a" * 63)

FULL = Recipe(
    experiment="ball",
    tracker="condensation",
    seed=LARGEST_SEED,
    frames=3,
    timeline=(Change(0, {"sample_count": 40}), Change(2, {"tracker": "apf", "gamma_px": 9.0})),
    footage=Footage(
        sha256="0" * 64,
        name="face.mp4",
        path="clips/face.mp4",
        start=1,
        mark={"kind": "box", "x": 60.0, "y": 30.0, "width": 40.0, "height": 50.0},
        truth={1: (60.0, 30.0, 40.0, 50.0)},
        labelled=True,
        square=True,
    ),
    filters={"mine": (TEXT,)},
    defaults={"forgetting": 0.99},
)


def opened(footage: Footage) -> FrameSequence:
    assert footage.path == "clips/face.mp4"
    return Pictures(pictures(4, width=160))


def test_no_field_has_its_default_value() -> None:
    """So that the tests below say of every field, also of one to come, that it is nowhere forgotten."""
    for value in (FULL, FULL.footage):
        for name, field in type(value).model_fields.items():
            assert getattr(value, name) != field.default, name


def test_it_is_whole_wherever_a_run_is_kept(tmp_path: Path) -> None:
    """A run, its file, a request and a stored session give back every field."""
    trust(TEXT)
    run = make(FULL, open_sequence=opened)
    # The default is today's, so that a run need not say it. A file says all of them.
    # Whether a recording brings its truth is for the recording to say.
    short = FULL.model_copy(update={"defaults": {}}).with_footage(labelled=False)
    assert run.recipe.with_footage(path="clips/face.mp4") == short
    save(run, tmp_path / "a.pft", footage_path="clips/face.mp4")
    kept = read(tmp_path / "a.pft").recipe
    assert kept.model_copy(update={"defaults": {}}) == short
    assert kept.defaults.items() >= FULL.defaults.items()
    assert load(tmp_path / "a.pft", open_sequence=opened).recipe == run.recipe
    assert SessionCreate.model_validate({"recipe": json.loads(FULL.model_dump_json())}).recipe == FULL
    branch = BranchSpec(title="Main", run=RunSnapshot(recipe=FULL, tracker="apf"))
    stored = SessionSpec(id="s", branches={"b0": branch}).model_dump_json()
    assert SessionSpec.model_validate_json(stored).recipe == FULL


@pytest.mark.parametrize(
    ("raw", "field"),
    [
        ([], "recipe"),
        ({}, "experiment"),
        ({"experiment": "ball", "colour": 1}, "colour"),
        ({"experiment": "ball", "seed": LARGEST_SEED + 1}, "seed"),
        ({"experiment": "ball", "frames": 0}, "frames"),
        ({"experiment": "ball", "timeline": [{"frame": -1, "values": {}}]}, "timeline.0.frame"),
        ({"experiment": "ball", "footage": {"sha256": "abc"}}, "footage.sha256"),
        *(({"experiment": "ball", "filters": {"mine": [TEXT, f"sha256:{it}"]}}, "filters.mine.1") for it in WRONG),
    ],
)
def test_what_is_no_recipe_is_refused_by_field(raw: Any, field: str) -> None:
    """The sentence names the field that is missing, unknown or out of bounds."""
    with pytest.raises(ParameterError) as caught:
        Recipe.read(raw)
    assert caught.value.field == field


# Reproduction: whether a run has the numbers of its file.


@pytest.fixture(scope="module")
def sine_run() -> Run:
    return whole_run(find("sine"), seed=4, frames=12)


@pytest.fixture
def saved(sine_run: Run, tmp_path: Path) -> Saved:
    save(sine_run, tmp_path / "run.pft")
    return read_saved(tmp_path / "run.pft")


def other(saved: Saved, estimates: np.ndarray | None, **more: Any) -> Saved:
    """Return a file of other estimates."""
    return Saved(saved.record.model_copy(update={"estimates_sha256": "0" * 64, **more}), estimates)


def test_numbers_are_compared_by_their_hash(sine_run: Run, saved: Saved) -> None:
    """A run and its own file are equal, and the file says on what it was computed; other numbers have another hash."""
    assert difference(sine_run, saved) is None
    assert saved.record.computed_on == machine.describe_platform()
    assert saved.estimates.shape == (12, 1)
    # Another version may estimate other components; then no first frame can be named.
    for estimates in (None, np.zeros((12, 3))):
        apart = difference(sine_run, other(saved, estimates))
        assert (apart.frame, apart.largest) == (None, None)
        assert apart.sentence.startswith("the numbers differ from the saved ones; ")


def test_the_first_frame_that_differs_is_named(sine_run: Run, saved: Saved) -> None:
    """Other numbers are reported: first frame, largest difference, and what differs about the machine."""
    estimates = saved.estimates.copy()
    estimates[5:] += 0.25
    estimates[7] = np.nan
    apart = difference(sine_run, other(saved, estimates, computed_on={**machine.describe_platform(), "numpy": "1.0"}))
    assert (apart.frame, apart.largest) == (5, pytest.approx(0.25))
    assert apart.sentence.startswith("the numbers differ from the saved ones from frame 5 on, by up to 0.25; ")
    assert f"numpy 1.0 (here {machine.describe_platform()['numpy']})" in apart.sentence
    assert json.loads(json.dumps(apart.as_dict()))["first_frame"] == 5


@pytest.mark.parametrize("value", [np.nan, np.inf])
def test_what_is_not_finite_differs_by_no_number(sine_run: Run, saved: Saved, value: float) -> None:
    """Where one of two numbers is not finite, the frame is named without a distance; JSON has no such number either."""
    apart = difference(sine_run, other(saved, np.where(np.arange(12)[:, None] == 3, value, saved.estimates)))
    assert (apart.frame, apart.largest) == (3, None)
    assert apart.sentence.startswith("the numbers differ from the saved ones from frame 3 on; ")
    assert json.loads(json.dumps(apart.as_dict(), allow_nan=False))["largest"] is None
    both = np.full((2, 1), value)
    assert departure(both.tolist(), other(saved, both)) is None
