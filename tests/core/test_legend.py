"""The legend names what is drawn, and nothing else."""

import numpy as np

from pftrack.core.model.drawing import COLOURS, Drawing, Key, Layer, Points, Polyline, drawn_keys

PREDICTED, OBSERVED = Key("prediction", "predicted"), Key("observation", "observed")
LAYERS = (Layer("particles", legend=(PREDICTED, OBSERVED)), Layer("trail", legend=(Key("estimate", "estimate"),)))


def cloud(*colours: str) -> Drawing:
    rgb = np.array([COLOURS[name] for name in colours], dtype=np.uint8).reshape(-1, 3)
    return Drawing(8, 8, {"cloud": Points(np.zeros((len(rgb), 3), dtype=np.float32), rgb, 2.0)})


def test_only_colours_that_are_drawn_have_a_key() -> None:
    """A method that never draws from the observation needs no key for it, and an empty layer none at all."""
    assert drawn_keys(cloud("prediction"), LAYERS) == (("particles", PREDICTED),)
    assert drawn_keys(cloud("prediction", "observation"), LAYERS) == (("particles", PREDICTED), ("particles", OBSERVED))
    assert drawn_keys(cloud(), LAYERS) == ()
    assert drawn_keys(Drawing(8, 8), LAYERS) == ()


def test_shades_need_all_keys_of_their_layer() -> None:
    """A layer in none of its keys' colours is explained whole; a line without places is not there."""
    line = Polyline(np.zeros((2, 3), dtype=np.float32), (1, 2, 3), 1.0, "trail")
    assert drawn_keys(Drawing(8, 8, {"trail": line}), LAYERS) == (("trail", Key("estimate", "estimate")),)
    none = Polyline(np.zeros((0, 3), dtype=np.float32), COLOURS["estimate"], 1.0, "trail")
    assert drawn_keys(Drawing(8, 8, {"trail": none}), LAYERS) == ()
