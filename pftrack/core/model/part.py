"""Parts: what a number is made of, so that a person can look at it and not only at the number.

A likelihood compares what it expects with what it finds; each kind of comparison is a kind of part, which whoever shows
it, a page or a notebook, knows how to draw:

- `Amount`: a number, and the limit that it should stay within;
- `Residual`: a number found beside the one expected, and the deviation that is expected of their difference;
- `Histograms`: shares found beside shares expected;
- `Patches`: a piece of a picture beside the one expected;
- `Contributions`: a table of what several things had their share in, with arrows in the picture where they pull.
"""

from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

__all__ = ["Amount", "Contributions", "Histograms", "Part", "Patches", "Residual"]


@dataclass(frozen=True, slots=True)
class Amount:
    """A number.

    Attributes:
        title: What it is, a few words.
        value: NaN where it is not known.
        unit: Of it; empty for a pure number.
        limit: What it should not be above; None where there is no such limit.
    """

    title: str
    value: float
    unit: str = ""
    limit: float | None = None


@dataclass(frozen=True, slots=True)
class Residual:
    """A number found beside the one expected.

    Attributes:
        title: What it is, a few words.
        found: NaN where nothing is found.
        expected: Of it.
        sd: Standard deviation of the difference.
        unit: Of all three; empty for a pure number.
    """

    title: str
    found: float
    expected: float
    sd: float
    unit: str = ""


@dataclass(frozen=True, slots=True)
class Histograms:
    """Shares found beside shares expected.

    Attributes:
        title: What is counted, a few words.
        expected: (B,) of the model.
        found: (B,), as many.
        colours: (B,) RGB of what is counted, 0..255; empty where it has no colour.
    """

    title: str
    expected: tuple[float, ...]
    found: tuple[float, ...]
    colours: tuple[tuple[int, int, int], ...] = ()


@dataclass(frozen=True, slots=True, eq=False)
class Patches:
    """A piece of a picture beside the one expected.

    Attributes:
        title: What they show, a few words.
        expected_rgb: (h, w, 3).
        found_rgb: (h', w', 3); empty where it lies outside the picture.
    """

    title: str
    expected_rgb: NDArray[np.uint8]
    found_rgb: NDArray[np.uint8]


@dataclass(frozen=True, slots=True)
class Contributions:
    """What several things had their share in.

    Attributes:
        title: What they contributed to, a few words.
        columns: What is said of each; a unit stands in brackets.
        names: Of the F things.
        rows: (F, len(columns)) numbers; NaN where one is not known.
        arrows: (F, 4) where each stands in the picture and where it pulls to, x, y, x, y, px; empty without.
    """

    title: str
    columns: tuple[str, ...]
    names: tuple[str, ...]
    rows: tuple[tuple[float, ...], ...]
    arrows: tuple[tuple[float, float, float, float], ...] = ()


Part: TypeAlias = Amount | Residual | Histograms | Patches | Contributions
