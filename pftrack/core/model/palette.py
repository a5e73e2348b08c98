"""The palette: every colour that carries a meaning, once, for scenes, films, figures, maps and pages.

All are, or are mixed from, the eight colours of Okabe and Ito (Color Universal Design, 2008), which can be
distinguished without red and green. A colour is sRGB, (red, green, blue) of 0 to 255; `hexadecimal` writes it as CSS,
matplotlib reads it. Where a page has a dark form of a colour, a `Themed` pair holds both.
"""

from typing import NamedTuple, TypeAlias

Colour: TypeAlias = tuple[int, int, int]


class Themed(NamedTuple):
    """A colour on a light ground, and what stands for it on a dark one."""

    light: Colour
    dark: Colour


OKABE_ITO: dict[str, Colour] = {
    "black": (0, 0, 0),
    "orange": (230, 159, 0),
    "sky blue": (86, 180, 233),
    "bluish green": (0, 158, 115),
    "yellow": (240, 228, 66),
    "blue": (0, 114, 178),
    "vermillion": (213, 94, 0),
    "reddish purple": (204, 121, 167),
}
"""The eight colours by their authors' names."""

VIRIDIS: tuple[Colour, ...] = (
    (68, 1, 84),
    (72, 26, 108),
    (71, 47, 125),
    (65, 68, 135),
    (57, 86, 140),
    (49, 104, 142),
    (42, 120, 142),
    (35, 136, 142),
    (31, 152, 139),
    (34, 168, 132),
    (53, 183, 121),
    (84, 197, 104),
    (122, 209, 81),
    (165, 219, 54),
    (210, 226, 27),
    (253, 231, 37),
)
"""Map of amounts in equal steps: matplotlib's viridis, which grows evenly in lightness."""

COLOURS: dict[str, Colour] = {
    "estimate": OKABE_ITO["blue"],
    "truth": OKABE_ITO["black"],
    "prediction": OKABE_ITO["orange"],
    "observation": OKABE_ITO["sky blue"],
    "lost": OKABE_ITO["vermillion"],
    "second": OKABE_ITO["bluish green"],
    "hidden": (128, 128, 128),
    "camera": (72, 72, 72),
    "paper": (255, 255, 255),
    "inspected": OKABE_ITO["reddish purple"],
    "sure": VIRIDIS[0],
    "unsure": VIRIDIS[-1],
}
"""One colour a meaning, the same in scene, plots, video and maps."""

CURVES: tuple[Colour, ...] = (
    OKABE_ITO["blue"],
    OKABE_ITO["orange"],
    OKABE_ITO["bluish green"],
    OKABE_ITO["reddish purple"],
    OKABE_ITO["sky blue"],
    OKABE_ITO["vermillion"],
    OKABE_ITO["black"],
    (153, 153, 153),
)
"""Curves of one figure, in an order in which neighbours differ in lightness."""

BRANCHES: tuple[Colour, ...] = (
    COLOURS["estimate"],
    COLOURS["second"],
    OKABE_ITO["reddish purple"],
    OKABE_ITO["orange"],
    OKABE_ITO["sky blue"],
    OKABE_ITO["vermillion"],
)
"""Branches of a session: the active one and the second run as the scene shows them, then what is left."""

VERDICTS: dict[str, Themed] = {
    "first": Themed(OKABE_ITO["blue"], (86, 160, 215)),
    "second": Themed(OKABE_ITO["orange"], OKABE_ITO["orange"]),
    "none": Themed((204, 204, 204), (92, 99, 109)),
    "untested": Themed((255, 255, 255), (27, 30, 35)),
}
"""Outcome of a test between two methods: which is better, neither, or the test does not apply."""

DIVERGING: tuple[Themed, ...] = (
    Themed((107, 61, 0), (253, 210, 110)),
    Themed(OKABE_ITO["orange"], (214, 150, 20)),
    Themed((243, 207, 128), (112, 80, 16)),
    Themed((244, 244, 244), (52, 56, 64)),
    Themed((128, 184, 216), (24, 86, 128)),
    Themed(OKABE_ITO["blue"], (60, 150, 210)),
    Themed((0, 50, 79), (150, 205, 240)),
)
"""Map of differences in equal steps: second method ahead, neither, first method ahead."""

NEUTRALS: dict[str, Colour] = {
    "outline": (136, 136, 136),
    "frame": (170, 170, 170),
    "hatching": (196, 196, 196),
    "grid": (229, 229, 229),
    "missing": (236, 236, 236),
}
"""Greys of a figure's furniture, by use; `missing` are cells of which nothing is known."""


def hexadecimal(colour: Colour) -> str:
    """Return a colour as "#rrggbb"."""
    return "#{:02x}{:02x}{:02x}".format(*colour)
