"""Recipes: one JSON form, which is whole wherever a run is kept, and refused by field."""

import json
from pathlib import Path
from typing import Any

import pytest

from pftrack.core.model.recipe import Change, Footage, Recipe
from pftrack.core.model.source import FrameSequence
from pftrack.core.numerics.random import LARGEST_SEED
from pftrack.core.refusal import ParameterError
from pftrack.experiments import find
from pftrack.experiments.own.code import trust
from pftrack.runs.record import read, save
from pftrack.runs.reproduction import load, make
from pftrack_server.sessions.create import SessionCreate
from pftrack_server.sessions.spec import BranchSpec, RunSnapshot, SessionSpec
from tests.experiments.head.heads import Pictures, pictures

TEXT = "def should_resample(log_weights):\n    return True\n"

NO_HASHES = [
    f"sha256:{said}"
    for said in (
        "",
        "../../../Downloads/evil",
        "A" * 64,
        "a" * 63,
        "a" * 65,
        "a" * 64 + "\n",
        "/" + "a" * 63,
        "a" * 9000,
    )
]

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
    recipe = Recipe.read({"experiment": "sine"})
    assert recipe.as_dict() == {"experiment": "sine"}
    made = make(recipe)
    assert (made.tracker, made.seed, made.frames) == (find("sine").default_tracker, 0, find("sine").frames)


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
