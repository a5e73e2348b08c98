"""Two sets of values: those of the lecture, which the lawn has, and the best that we know, which recordings have.

The lawn keeps those of the lecture: it is the lecture's scene, and what it shows (a sharp likelihood that clings, a
velocity that carries) would be hidden by what helps on real pictures.
"""

from collections.abc import Mapping
from types import MappingProxyType

from pftrack.core.model.parameters import Value

__all__ = ["LECTURE", "PICTURES"]

LECTURE: Mapping[str, Value] = MappingProxyType(
    {
        "sharpness": 20,
        "colour_space": "hsv",
        "spatial_kernel": False,
        "parts_across": 1,
        "parts_down": 1,
        "weigh_background": False,
        "surround_contrast": 0,
        "velocity_retention": 1,
        "wide_share": 0,
        "follow_size": False,
        "follow_camera": False,
        "find_again": False,
        "renewal_rate": 0,
    }
)
"""One histogram of all pixels alike, constant velocity and a window that keeps its size (Kagami 2012).

Lengths are not among them: those of the lawn are the defaults, and those of a recording fit its box.
"""

PICTURES: Mapping[str, Value] = MappingProxyType(
    {
        "sharpness": 70,
        "spatial_kernel": True,
        "parts_across": 2,
        "parts_down": 3,
        "weigh_background": True,
        "surround_contrast": 0.4,
        "follow_size": True,
        "size_noise": 0.012,
        "follow_camera": True,
        "wide_share": 0.1,
    }
)
"""Parts, colours beside their background, contrast, size and camera; each helped on clips that were chosen by."""
