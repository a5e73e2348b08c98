"""Layers as an experiment declares them."""

import pytest

from pftrack.core.model.drawing import Key, Layer, legend


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
