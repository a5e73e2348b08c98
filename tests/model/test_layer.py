"""Layers as an experiment declares them."""

import pytest

from pftrack.experiments import EXPERIMENTS
from pftrack.model.layer import Key, Layer, legend
from pftrack.model.palette import COLOURS


def test_a_layer_is_called_by_its_name_unless_told_otherwise() -> None:
    """Its title begins with a capital letter."""
    assert Layer("exact (Kalman)").title == "Exact (Kalman)"
    assert Layer("a", "Another").title == "Another"


def test_a_colour_without_a_meaning_is_refused() -> None:
    """The sentence names those that there are."""
    with pytest.raises(ValueError, match="there is no colour 'pink'; there are estimate, truth"):
        Key("pink", "a dream")


def test_the_legend_says_each_meaning_once_in_the_palettes_order() -> None:
    """Two layers may share a meaning, and one colour may have several."""
    past, pose = Key("prediction", "from its own past"), Key("observation", "from the pose")
    layers = (Layer("clouds", legend=(pose, past)), Layer("traces", legend=(past,)), Layer("truth"))
    assert legend(layers) == (past, pose)


@pytest.mark.parametrize("name", EXPERIMENTS)
def test_every_experiment_names_its_layers_once_and_explains_its_estimate(name: str) -> None:
    """A primitive on a layer can be switched, and whoever looks knows which one is the estimate."""
    layers = EXPERIMENTS[name].layers
    assert len({layer.name for layer in layers}) == len({layer.title for layer in layers}) == len(layers)
    assert "estimate" in {key.colour for key in legend(layers)}
    assert [key.colour for key in legend(layers)] == sorted(
        (key.colour for key in legend(layers)), key=list(COLOURS).index
    )


@pytest.mark.parametrize("name", EXPERIMENTS)
def test_what_is_seen_from_aside_only_takes_the_place_of_something(name: str) -> None:
    """A layer through time is off at first, where everybody looks from the front, and comes with one that is flat."""
    layers = EXPERIMENTS[name].layers
    through_time = [layer for layer in layers if layer.role == "through time"]
    assert not any(layer.shown for layer in through_time)
    assert bool(through_time) == any(layer.role == "flat only" for layer in layers)
