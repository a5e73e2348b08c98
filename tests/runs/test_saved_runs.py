"""Runs that were saved long ago: computed again from their recipes, they come to the same bits."""

from collections.abc import Mapping
from pathlib import Path

import pytest

from pftrack.core.model.parameters import Value
from pftrack.core.model.recipe import Change, Recipe
from pftrack.core.refusal import RefusedError
from pftrack.experiments import EXPERIMENTS
from pftrack.runs.record import read, save
from pftrack.runs.reproduction import load, make

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
