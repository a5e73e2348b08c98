"""Saved runs: the same numbers from files of today and of long ago, and a clear word for every file that is none."""

import io
import json
import zipfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from pftrack.core.model.marks import Box
from pftrack.core.model.parameters import Value
from pftrack.core.model.recipe import Change, Footage, Recipe
from pftrack.core.model.source import FrameSequence
from pftrack.core.numerics.random import LARGEST_SEED
from pftrack.core.refusal import ParameterError, RefusedError
from pftrack.experiments import EXPERIMENTS, find
from pftrack.experiments.own.code import trust
from pftrack.runs import record
from pftrack.runs.record import read, read_saved, save
from pftrack.runs.reproduction import load, make
from pftrack.runs.run import Run
from pftrack.runs.table import clouds_of
from pftrack.sources.sequence import open_sequence
from pftrack_server.sessions.create import SessionCreate
from pftrack_server.sessions.spec import BranchSpec, RunSnapshot, SessionSpec
from tests.experiments.head.heads import Pictures, pictures
from tests.making import whole_run
from tests.sources.conftest import film

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


@pytest.mark.parametrize("computed", [0, -3, "many"])
def test_a_run_has_a_frame(path: Path, computed: object) -> None:
    """One that says that less was computed, or nothing, could be kept and never opened."""
    with pytest.raises(RefusedError, match="computed is missing or wrong"):
        read(_rewritten(path, computed=computed))


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
    count = run.parameters_at(0).sample_count
    assert clouds["cloud"].shape[:2] == clouds["cloud_log_weights"].shape == (run.computed + 1, count)
    cloud = run.experiment.trackers[run.tracker].cloud(run.seek(20).state)
    assert cloud is not None
    assert np.array_equal(clouds["cloud"][20], cloud.states)
    assert np.exp(clouds["cloud_log_weights"]).sum(axis=1) == pytest.approx(1)
    assert clouds["cloud_ancestors"][20].tolist() == np.asarray(cloud.ancestors).tolist()


def test_a_run_is_a_dataset(run: Run) -> None:
    """With titles and units, and the particles if wanted, for which xarray has to be there."""
    pytest.importorskip("xarray", reason="xarray is an extra")
    made = run.to_xarray(particles=True)
    assert (made["estimate_0"].attrs["units"], made["cloud"].dims) == ("px", ("frame", "particle", "component"))


def test_saving_replaces_whole_files_only(run: Run, path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """When writing fails, what was there before is still there, and nothing else."""
    before = path.read_bytes()

    def fail(*_: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("pftrack.runs.record._pack", fail)
    with pytest.raises(OSError, match="No space"):
        save(run, path)
    assert path.read_bytes() == before
    assert list(path.parent.iterdir()) == [path]


def test_foreign_files_are_refused(path: Path, tmp_path: Path) -> None:
    """A file that is missing, foreign, cut short or of a later format is refused with one sentence."""
    foreign = io.BytesIO()
    with zipfile.ZipFile(foreign, "w") as archive:
        archive.writestr("other.json", "{}")
    with pytest.raises(RefusedError, match="does not exist"):
        load(tmp_path / "missing.pft")
    cut = path.read_bytes()[:400]
    for content, word in ((cut, "cut short"), (b"hello", "not a saved run"), (foreign.getvalue(), "not a saved run")):
        path.write_bytes(content)
        with pytest.raises(RefusedError, match=word):
            load(path)


@pytest.mark.parametrize("member", ["run.json", "diagnostics.npz"])
def test_a_damaged_archive_is_told_from_a_whole_one(path: Path, member: str) -> None:
    """Bytes that do not unpack any more make a description unreadable; without the numbers a run is still a run."""
    with zipfile.ZipFile(path) as archive:
        start = archive.getinfo(member).header_offset + 30 + len(member)
    data = path.read_bytes()
    path.write_bytes(data[:start] + bytes([0xFF]) * 40 + data[start + 40 :])
    if member == "run.json":
        with pytest.raises(RefusedError, match=r"a\.pft is not a saved run, or was cut short"):
            read(path)
    else:
        assert read_saved(path).record == read(path)
        assert read_saved(path).estimates is None


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
        ({"seed": "many"}, "seed"),
        ({"experiment": "cards"}, "got 'cards'"),
        ({"tracker": "magic"}, "tracker must be one of"),
        ({"timeline": [{"frame": 0, "values": {"colour_of_magic": 8}}]}, "colour_of_magic"),
        ({"timeline": [{"frame": 3, "values": {"sample_count": 0}}]}, "between 1 and"),
        ({"frames": -5}, "frames"),
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
    shown = []
    rows, columns = np.mgrid[0:90, 0:80]
    for number in range(8):
        shown.append(np.full((90, 80, 3), 180, np.uint8))  # a red disc in pixels that are twice as wide as high
        shown[-1][((columns - 30 - number) * 2) ** 2 + (rows - 45) ** 2 <= 144] = (208, 32, 32)
    lossless = {"qp": "0", "x264-params": "sar=2/1"}
    clip = film(tmp_path / "oblong.mkv", shown, "libx264rgb", "rgb24", codec_options=lossless)
    today = Run(BALL, BALL.video.on_video(open_sequence(clip), Box(x=48, y=33, width=24, height=24)), seed=2)
    today.finish()
    save(today, tmp_path / "today.pft")
    assert read(tmp_path / "today.pft").recipe.footage.square is True
    stored = open_sequence(clip, square=False).index
    again = load(tmp_path / "today.pft", open_sequence=lambda it: open_sequence(clip, index=stored, square=it.square))
    assert again.source.size == (160, 90)
    again.finish()
    assert again.estimates_sha256 == today.estimates_sha256
    assert today.diagnostics[-1].estimate[0] == pytest.approx(74, abs=3)


# Runs that were saved long ago: computed again from their recipes, they come to the same bits.

RUNS = Path(__file__).parents[1] / "data" / "runs"


def test_every_experiment_has_one() -> None:
    """Whoever changes a number of any experiment by accident is told."""
    assert {path.stem for path in RUNS.glob("*.pft")} == set(EXPERIMENTS)


@pytest.mark.parametrize("path", sorted(RUNS.glob("*.pft")), ids=lambda path: path.stem)
def test_it_comes_to_the_same_hash(path: Path) -> None:
    """The recipe alone gives the estimates of every frame again."""
    saved = read(path)
    again = load(path)
    again.seek(saved.computed - 1)
    assert again.estimates_sha256 == saved.estimates_sha256


@pytest.mark.parametrize(
    ("experiment", "former"),
    [
        ("hand", {"palm_count": 20, "palm_turn_sd_rad": 0.06, "palm_tilt_sd_rad": 0.1, "cover_sd": 0.04}),
        ("head", {"recognised_correlation": 0.5, "least_recognised": 3, "largest_misfit": 0.25}),
        ("prism", {"hidden_noise_px": 100}),
        ("recorded", {"example_particles": 300}),
    ],
)
def test_numbers_that_are_constants_now_open(experiment: str, former: Mapping[str, Value], tmp_path: Path) -> None:
    """A recipe and a saved run of before may name their only value; any other is refused by name."""
    recipe = Recipe(experiment=experiment, timeline=(Change(0, dict(former)),), frames=2)
    run = make(recipe)
    assert run.setup.parameters == run.parameters_at(0)
    save(run, tmp_path / "old.pft")
    assert load(tmp_path / "old.pft").parameters_at(0) == run.parameters_at(0)
    for name, value in former.items():
        other = recipe.model_copy(update={"timeline": (Change(0, {name: 2 * value}),)})
        with pytest.raises(RefusedError, match=rf"{name} must be {value}(\.0)?: it is a constant now"):
            make(other)


# Recipes: one JSON form, which is whole wherever a run is kept, and refused by field.

TEXT = "def should_resample(log_weights):\n    return True\n"

WRONG = ("", "../../../Downloads/evil", "A" * 64, "a" * 63, "a" * 65, "a" * 64 + "\n", "/" + "a" * 63, "a" * 9000)
NO_HASHES = [f"sha256:{said}" for said in WRONG]

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
    footage = FULL.footage
    assert footage is not None
    for value in (FULL, footage):
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


def test_a_person_may_leave_out_all_but_the_experiment() -> None:
    """The defaults are those of a run without options, and the short form has none of them."""
    recipe, sine = Recipe.read({"experiment": "sine"}), find("sine")
    assert recipe.as_dict() == {"experiment": "sine"}
    made = make(recipe)
    assert (made.tracker, made.seed, made.frames) == (sine.default_tracker, 0, sine.frames)


@pytest.mark.parametrize(
    ("raw", "field"),
    [
        ([], "recipe"),
        ({}, "experiment"),
        ({"experiment": "ball", "colour": 1}, "colour"),
        ({"experiment": "ball", "seed": LARGEST_SEED + 1}, "seed"),
        ({"experiment": "ball", "seed": -1}, "seed"),
        ({"experiment": "ball", "frames": 0}, "frames"),
        ({"experiment": "ball", "timeline": [{"frame": -1, "values": {}}]}, "timeline.0.frame"),
        ({"experiment": "ball", "footage": {"sha256": "abc"}}, "footage.sha256"),
        *(({"experiment": "ball", "filters": {"mine": [TEXT, hashed]}}, "filters.mine.1") for hashed in NO_HASHES),
    ],
)
def test_what_is_no_recipe_is_refused_by_field(raw: Any, field: str) -> None:
    """The sentence names the field that is missing, unknown or out of bounds."""
    with pytest.raises(ParameterError) as caught:
        Recipe.read(raw)
    assert caught.value.field == field
