"""Worlds are declared whole, and seen from where their viewpoints say."""

from typing import Any

import numpy as np
import pytest

from pftrack.core.model.drawing import FRONT_SIDE_TOP, Viewpoint, World


def world(**other: Any) -> World:
    return World("w", "World", "mm", **{"radius": 100.0, **other})


@pytest.mark.parametrize(
    ("azimuth", "elevation", "rows"),
    [
        (0, 0, [[1, 0, 0], [0, -1, 0], [0, 0, 1]]),
        (90, 0, [[0, 0, -1], [0, -1, 0], [1, 0, 0]]),
        (0, 90, [[1, 0, 0], [0, 0, 1], [0, 1, 0]]),
    ],
)
def test_a_viewer_sees_right_down_and_towards_himself(azimuth: float, elevation: float, rows: Any) -> None:
    """From the front x points to the right and y upwards; so they do from aside and from above, as turned."""
    np.testing.assert_allclose(world().turn(azimuth, elevation), rows, atol=1e-12)


def test_what_is_up_is_seen_upwards() -> None:
    """Where y points down and z away, as in a camera's frame, the picture is that of the camera."""
    seen = world(up=(0, -2, 0), front=(0, 0, -1)).turn(0, 0)
    np.testing.assert_allclose(seen, [[1, 0, 0], [0, 1, 0], [0, 0, -1]], atol=1e-12)


@pytest.mark.parametrize(("radius", "ruler"), [(100, 50), (99, 20), (140, 50), (1, 0.5), (0.03, 0.01), (4000, 2000)])
def test_a_ruler_is_a_round_number(radius: float, ruler: float) -> None:
    """It is 1, 2 or 5 times a power of ten, and at most half of the radius long."""
    assert world(radius=radius).ruler == pytest.approx(ruler)


@pytest.mark.parametrize(
    "wrong",
    [
        {"radius": 0},
        {"radius": float("nan")},
        {"middle": (0, float("inf"), 0)},
        {"front": (0, 1, 1)},
        {"up": (0, 0, 0)},
        {"viewpoints": ()},
        {"viewpoints": FRONT_SIDE_TOP[:1] * 2},
    ],
)
def test_what_cannot_be_shown_is_refused(wrong: dict[str, Any]) -> None:
    """A world without extent, upright axis or viewpoints is refused where it is declared."""
    with pytest.raises(ValueError, match=r"radius|right angles|viewpoints"):
        world(**wrong)


def test_a_viewpoint_is_not_beyond_the_poles() -> None:
    """Nobody looks from above the zenith."""
    with pytest.raises(ValueError, match=r"got 0\.0 and 91"):
        Viewpoint("over", "Over", 0.0, 91.0)
