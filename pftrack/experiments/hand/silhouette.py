"""Silhouettes: the pixels of a hand in a picture, a check that they can be one hand, and the skeleton.

A hand is separated from the rest by being lighter or darker than a level, by differing from the background, or by the
colour of skin. The background is the median colour along the picture's border; or, for a recording by a fixed camera,
each pixel's value without the hand (`backdrop_model`). Skin is a range of Cr and Cb, the two colours of YCrCb; it is
much the same for all people, who differ by Y (D. Chai and K. Ngan, 1999).

The largest connected part is the silhouette; pin-holes in it are filled. A `Finding` reports a silhouette that cannot
be a hand: nothing, nearly everything as after a flash of light, two parts of similar size, or a hand that reaches
beyond the picture. Large pictures are first reduced by a whole factor.
"""

import math
from enum import Enum
from functools import lru_cache
from typing import Literal, NamedTuple, TypeAlias

import cv2
import numpy as np
from numpy.typing import NDArray

from pftrack.core.arrays import Bools, Floats, Ints
from pftrack.core.model.parameters import Parameters, parameter
from pftrack.core.model.source import Backdrop
from pftrack.core.numerics.compiled import compiled, read_only

# With a fixed camera, a pixel's median over pictures is its usual value, whatever passes by. The median of the absolute
# deviations measures its variation, by noise or by leaves in the wind; passing objects do not enlarge it while they
# cover the pixel less than half of the time. The pictures are few and always the same ones, so a frame has the same
# background when one plays, seeks or branches.
#
# Where the target stays for half of them, the median is the target. Near that the model is in doubt, and so it is where
# the camera moves: then a pixel is off the median in many of the pictures (`doubtful`).

NORMAL_SD = 1.4826
"""Standard deviation of a normal distribution, relative to the median of its absolute deviations."""
DEVIATIONS = 4.0
"""Standard deviations beyond which a varying pixel differs."""
MAJORITY = 0.7
"""Share of the pictures that show a pixel as the median has it, where the model is not in doubt."""


class BackdropModel(NamedTuple):
    """The background of a fixed camera.

    Attributes:
        median_rgb: (h, w, 3) grey levels.
        sd_rgb: (h, w, 3) standard deviation of each pixel, grey levels.
        majority_rgb: (h, w, 3) deviation from the median that this share of the pictures stays within, grey levels.
    """

    median_rgb: NDArray[np.float32]
    sd_rgb: NDArray[np.float32]
    majority_rgb: NDArray[np.float32]


@lru_cache(maxsize=2)
def backdrop_model(backdrop: Backdrop, first: int, reduction: int) -> BackdropModel:
    """Return the model of a recording's background; those of the last recordings are cached.

    Args:
        backdrop: Source of the pictures.
        first: Number of first pictures that show only the background; 0 to use pictures of the whole recording.
        reduction: Factor of the pictures' reduction, a whole number.
    """
    pictures = np.array([smaller(picture, reduction) for picture in backdrop.pictures(first)], np.float32)
    median = _middle(np.sort(pictures, axis=0))
    away = np.sort(np.abs(pictures - median), axis=0)
    majority = away[math.ceil(MAJORITY * len(away)) - 1].copy()
    return BackdropModel(read_only(median), read_only(np.float32(NORMAL_SD) * _middle(away)), read_only(majority))


def _middle(ordered: NDArray[np.float32]) -> NDArray[np.float32]:
    """Return the median (h, w, 3) of sorted pictures (n, h, w, 3); `np.median` takes several times as long."""
    last = len(ordered) - 1
    middle: NDArray[np.float32] = np.float32(0.5) * (ordered[last // 2] + ordered[last - last // 2])
    return middle


def differs(image_rgb: NDArray[np.uint8], model: BackdropModel, least: int) -> Bools:
    """Return the pixels (h, w) that differ from the background.

    Args:
        image_rgb: (h, w, 3), as small as the model.
        model: Model of the background.
        least: Least difference of a pixel in one channel, grey levels; more where the background varies.
    """
    return _beyond(np.abs(image_rgb.astype(np.float32) - model.median_rgb), model, least)


def doubtful(model: BackdropModel, least: int) -> Bools:
    """Return the pixels (h, w) whose background is doubtful, because they differ from it in many of its pictures.

    Args:
        model: Model of the background.
        least: As for `differs`.
    """
    return _beyond(model.majority_rgb, model, least)


def _beyond(away: NDArray[np.float32], model: BackdropModel, least: int) -> Bools:
    """Return which pixels (h, w) deviations (h, w, 3) from the median are too great for, in one channel at least."""
    return np.asarray((away >= np.maximum(np.float32(least), np.float32(DEVIATIONS) * model.sd_rgb)).any(axis=2))


def smaller(image_rgb: NDArray[np.uint8], reduction: int) -> NDArray[np.uint8]:
    """Return a picture (h, w, 3) whose pixels are means of squares of pixels; the rest at the ends is cut."""
    if reduction == 1:
        return image_rgb
    height, width = (max(side // reduction, 1) for side in image_rgb.shape[:2])
    whole = image_rgb[: height * reduction, : width * reduction]
    return np.asarray(cv2.resize(whole, (width, height), interpolation=cv2.INTER_AREA), np.uint8)


TellsBy: TypeAlias = Literal["light", "dark", "background", "skin", "backdrop"]

LEAST_SHARE, LARGEST_SHARE = 0.005, 0.75
"""Least and largest share of the picture for a hand."""
ALIKE = 0.4
"""A second thing of this share of the largest one's area is another hand, or something else to be taken away."""
PIN_HOLE = 0.006
"""Share of the silhouette's area up to which a hole is filled: a rough edge closes the gap between two fingers."""
TWO_CLASSES = 0.86
"""Least share of the variance of brightness between two classes; an even slope has 0.75."""
MOST_FIRST = 1000
"""Pictures at the beginning of a recording that show the backdrop."""
DOUBTFUL_SHARE = 0.2
"""Largest share of a silhouette before a doubtful backdrop; a passing hand has 0 to 0.07."""
GAP_PX = 4
"""Gaps along the picture's border that do not end a contact."""

WORKING_SIDE_PX = 256
"""Larger pictures are made smaller by a whole factor, to about this longer side."""

GROUP = "Silhouette"


class Finding(Enum):
    """The problem with a silhouette, as a sentence; empty if it may be a hand."""

    CLEAR = ""
    EMPTY = "nothing in the picture is classified as a hand"
    FULL = "nearly the whole picture is classified as a hand, as after a flash of light"
    SEVERAL = "two regions of similar size are classified as hands"
    CUT = "the hand reaches beyond the picture"
    AS_BACKDROP = (
        "nothing in the picture differs from the backdrop, which shows the hand as well if that stays where it is in "
        "half of the backdrop's pictures"
    )
    DOUBTFUL = (
        "much of what differs from the backdrop does so in many of the backdrop's pictures: the hand stays where it is "
        "for too long, or the camera moves"
    )

    @property
    def ok(self) -> bool:
        """Whether the silhouette may be that of a hand."""
        return self is Finding.CLEAR


class SilhouetteParameters(Parameters, group=GROUP, constants={"working_side_px": 256}):
    """The region classified as a hand."""

    tells_by: TellsBy = parameter("light", "Told by")
    """How the hand is separated from the rest: by being lighter or darker than a level, by differing from the
    background, which is the colour along the border, by the colour of skin, or by differing from the backdrop, which is
    what each pixel of a recording by a fixed camera shows without the hand."""
    brightness_level: int = parameter(100, "Brightness level", unit="grey levels", within=(0, 254, 1))
    """Level that a light hand exceeds, and a dark one does not."""
    background_difference: int = parameter(40, "Least difference", unit="grey levels", within=(1, 254, 1))
    """Least difference of a hand from the background in one channel."""
    backdrop_frames: int = parameter(
        0, "Pictures of the backdrop", unit="frames", within=(0, MOST_FIRST, 1), useful=(0, 100)
    )
    """Number of the recording's first pictures without a hand, which show the backdrop; at 0 it is the median over the
    whole recording, in which a moving hand leaves no trace."""
    cr_low: int = parameter(135, "Least red", within=(0, 255, 1))
    """Lowest Cr of skin: 128 is grey, more is redder."""
    cr_high: int = parameter(180, "Most red", within=(0, 255, 1))
    """Highest Cr of skin."""
    cb_low: int = parameter(77, "Least blue", within=(0, 255, 1))
    """Lowest Cb of skin: 128 is grey, less is yellower."""
    cb_high: int = parameter(127, "Most blue", within=(0, 255, 1))
    """Highest Cb of skin."""
    smoothing_px: int = parameter(1, "Smoothing", unit="px", within=(1, 15, 2))
    """Side of the square whose majority decides about a pixel; 1 for none. It takes away what is thinner than half of
    it."""


class Silhouette(NamedTuple):
    """The region classified as a hand.

    Attributes:
        mask: (h, w) of the picture made smaller; all False if nothing was found.
        reduction: px of the picture for a px of the mask, a whole number.
        finding: Its problem.
    """

    mask: Bools
    reduction: int
    finding: Finding

    def in_picture(self, places: Floats) -> Floats:
        """Return where places (..., 2) of the mask are in the picture, px: its pixels are squares of the picture's."""
        return (places + 0.5) * self.reduction - 0.5

    def in_mask(self, places: Floats) -> Floats:
        """Return where places (..., 2) of the picture are in the mask, px."""
        return (places + 0.5) / self.reduction - 0.5


def silhouette_of(
    image_rgb: NDArray[np.uint8], settings: SilhouetteParameters, backdrop: Backdrop | None = None
) -> Silhouette:
    """Return the silhouette in a picture (height, width, 3).

    Args:
        image_rgb: (height, width, 3).
        settings: Settings of the separation.
        backdrop: Backdrop of the recording; without one, the colour along the border is used.
    """
    reduction = max(round(max(image_rgb.shape[:2]) / WORKING_SIDE_PX), 1)
    image = smaller(image_rgb, reduction)
    model: BackdropModel | None = None
    if settings.tells_by == "backdrop" and backdrop is not None:
        model = backdrop_model(backdrop, settings.backdrop_frames, reduction)
        told = differs(image, model, settings.background_difference).astype(np.uint8)
    else:
        told = _classify_pixels(image, settings)
    if settings.smoothing_px > 1:
        told = np.asarray(cv2.medianBlur(told, settings.smoothing_px | 1), np.uint8)  # its side is odd
    area = told.size
    count, labels, numbers, _ = cv2.connectedComponentsWithStats(told, connectivity=8)
    sizes = numbers[1:, cv2.CC_STAT_AREA]
    if count < 2 or sizes.max() < LEAST_SHARE * area:
        nothing = Finding.EMPTY if model is None else Finding.AS_BACKDROP
        return Silhouette(np.zeros(told.shape, np.bool_), reduction, nothing)
    largest = int(np.argmax(sizes))
    mask = _without_pin_holes(labels == largest + 1)
    if model is not None and doubtful(model, settings.background_difference)[mask].mean() > DOUBTFUL_SHARE:
        return Silhouette(mask, reduction, Finding.DOUBTFUL)
    return Silhouette(mask, reduction, _finding(mask, np.sort(sizes)))


def _finding(mask: Bools, sizes: NDArray[np.int32]) -> Finding:
    """Return the problem with a silhouette, given the areas of all separated parts, the largest last."""
    if np.count_nonzero(mask) > LARGEST_SHARE * mask.size:
        return Finding.FULL
    if len(sizes) > 1 and sizes[-2] > ALIKE * sizes[-1]:
        return Finding.SEVERAL
    return Finding.CUT if len(contacts(mask)) > 1 else Finding.CLEAR


def contacts(mask: Bools) -> Ints:
    """Return the lengths (k,) of the runs in which a silhouette touches the picture's border, px."""
    around = np.concatenate([mask[0], mask[1:, -1], mask[-1, -2::-1], mask[-2:0:-1, 0]])
    if around.all() or not around.any():
        return np.full(int(around.all()), len(around))
    turned = np.roll(around, -int(np.argmin(around)))  # begins outside, so no run is cut
    changes = np.diff(np.concatenate([[False], turned, [False]]).astype(np.int8))
    begins, ends = np.nonzero(changes == 1)[0], np.nonzero(changes == -1)[0]
    apart = begins[1:] - ends[:-1] > GAP_PX
    return np.asarray(ends[np.append(apart, True)] - begins[np.append(True, apart)], np.int64)


def _classify_pixels(image: NDArray[np.uint8], settings: SilhouetteParameters) -> NDArray[np.uint8]:
    """Return (h, w) 1 where a picture is classified as a hand."""
    if settings.tells_by in {"background", "backdrop"}:
        away = cv2.absdiff(image, np.broadcast_to(_border_colour(image), image.shape))
        return np.asarray(away.max(axis=2) >= settings.background_difference, np.uint8)
    if settings.tells_by == "skin":
        luma_red_blue = cv2.cvtColor(image, cv2.COLOR_RGB2YCrCb)
        low, high = (0, settings.cr_low, settings.cb_low), (255, settings.cr_high, settings.cb_high)
        return np.asarray(cv2.inRange(luma_red_blue, low, high) > 0, np.uint8)
    grey = cv2.cvtColor(image, cv2.COLOR_RGB2GRAY)
    lighter = grey > settings.brightness_level
    return np.asarray(lighter if settings.tells_by == "light" else ~lighter, np.uint8)


def _border_colour(image: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Return the median colour (3,) along the border of a picture."""
    border = np.concatenate([image[0], image[-1], image[:, 0], image[:, -1]])
    return np.asarray(np.sort(border, axis=0)[len(border) // 2])


def _without_pin_holes(mask: Bools) -> Bools:
    count, labels, numbers, _ = cv2.connectedComponentsWithStats((~mask).astype(np.uint8), connectivity=4)
    if count <= 2:  # the silhouette and one thing around it
        return mask
    height, width = mask.shape
    x, y, w, h, area = numbers.T
    within = (x > 0) & (y > 0) & (x + w < width) & (y + h < height)
    small = within & (area <= PIN_HOLE * np.count_nonzero(mask))
    small[0] = False
    return np.asarray(mask | small[labels]) if small.any() else mask


def suggest_parameters(
    image_rgb: NDArray[np.uint8], backdrop: Backdrop | None = None, before: int = 0
) -> dict[str, object]:
    """Return values of `SilhouetteParameters` that best separate a hand in a picture (height, width, 3).

    The first choice is brightness, if it divides the picture into two classes (Otsu 1979); the hand's class is the
    rarer one along the border. Then follow the colour of skin, if something in the picture has it; the difference from
    the border; and the difference from the backdrop, if there is one, by the pictures before this one or by all of
    them.

    Args:
        image_rgb: (height, width, 3).
        backdrop: Backdrop of the recording.
        before: Number of its pictures before this one. A power of two of them is used, so successive pictures share few
            models.
    """
    image = smaller(image_rgb, max(round(max(image_rgb.shape[:2]) / 256), 1))
    grey = np.asarray(cv2.cvtColor(image, cv2.COLOR_RGB2GRAY), np.uint8)
    level = int(cv2.threshold(grey, 0, 255, cv2.THRESH_OTSU)[0])
    light = grey > level
    choices: list[dict[str, object]] = [{"tells_by": by, "smoothing_px": 5} for by in ("skin", "background")]
    if backdrop is not None:
        firsts = (1 << min(before, MOST_FIRST).bit_length() - 1, 0) if before else (0,)
        choices += [{"tells_by": "backdrop", "backdrop_frames": first, "smoothing_px": 5} for first in firsts]
    share, total = float(light.mean()), float(grey.var())
    if 0.0 < share < 1.0:
        apart = float(grey[light].mean() - grey[~light].mean())
        if share * (1.0 - share) * apart * apart >= TWO_CLASSES * total:
            border = np.concatenate([light[0], light[-1], light[:, 0], light[:, -1]])
            hand = light if border.mean() < 0.5 else ~light
            by_level = {"brightness_level": _level(grey, hand, level), "smoothing_px": 3}
            choices.insert(0, {"tells_by": "light" if hand is light else "dark", **by_level})
    for values in choices:
        if silhouette_of(image_rgb, SilhouetteParameters.model_validate(values), backdrop).finding.ok:
            return values
    return choices[0]


def _level(grey: NDArray[np.uint8], hand: Bools, otsu: int) -> int:
    """Return a level just beyond the background's, where it is narrow: a hand has shadows that are nearly as dark."""
    on, around = (np.sort(grey[side]).astype(np.int64) for side in (hand, ~hand))
    middle, away = int(around[len(around) // 2]), int(on[len(on) // 2])
    spread = int(np.sort(np.abs(around - middle))[len(around) // 2])
    # Some six standard deviations, and beyond the rings that compression leaves around an edge.
    beyond = max(9 * spread + 4, abs(away - middle) // 4)
    return min(otsu, middle + beyond) if away > middle else min(max(otsu, middle - beyond), 254)


# Thinning is that of Guo and Hall (1989): from two sides in turn, pixels are removed from the edge while the rest stays
# connected and keeps its ends. The decision on a pixel depends only on its eight neighbours, so a table holds it. Only
# whole numbers are involved.
#
# A rough edge makes short side lines. The distance transform shows which lines matter: for each pixel of the skeleton
# it holds the radius of the largest disc around it within the silhouette. Removing a side line loses only its extension
# beyond the disc at its junction; lines with a small extension are removed, the smallest first.

LEAST_GAIN_SHARE = 0.33
"""Least extension of a line, in radii of the disc at its junction."""

ACROSS, DOWN = np.array([0, 1, 1, 1, 0, -1, -1, -1]), np.array([-1, -1, 0, 1, 1, 1, 0, -1])
"""The eight neighbours, from the one above round by the right."""


def _removable() -> NDArray[np.uint8]:
    """Return (256,) which of the two passes may remove a pixel with these neighbours: bit 0 the first, 1 the second."""
    table = np.zeros(256, np.uint8)
    for code in range(256):
        n, ne, e, se, s, sw, w, nw = (bool(code >> bit & 1) for bit in range(8))
        parts = (not n and (ne or e)) + (not e and (se or s)) + (not s and (sw or w)) + (not w and (nw or n))
        sides = min((nw or n) + (ne or e) + (se or s) + (sw or w), (n or ne) + (e or se) + (s or sw) + (w or nw))
        if parts == 1 and 2 <= sides <= 3:
            table[code] |= not ((s or sw or not nw) and w)
            table[code] |= 2 * (not ((n or ne or not se) and e))
    return table


REMOVABLE = _removable()
CHANGES = np.array([((code & ~(code << 1 | code >> 7)) & 255).bit_count() for code in range(256)])
"""(256,) number of separate groups of neighbours: 1 at the end of a line, 2 on it, 3 and more where lines meet."""
NEIGHBOURS = np.array([code.bit_count() for code in range(256)])


@compiled
def skeleton(mask: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Return the skeleton (height, width), 0 or 1, of a mask whose outermost pixels are 0.

    Args:
        mask: (height, width), anything but 0 is inside.
    """
    height, width = mask.shape
    thin = np.zeros((height, width), np.uint8)
    places = np.empty(height * width, np.int64)
    count = 0
    for row in range(1, height - 1):
        for column in range(1, width - 1):
            if mask[row, column] != 0:
                thin[row, column] = 1
                places[count] = row * width + column
                count += 1
    flat = thin.ravel()
    steps = DOWN * width + ACROSS
    gone = np.empty(count, np.int64)
    idle, turn = 0, 0
    while idle < 2:
        removed, kept = 0, 0
        for i in range(count):
            place = places[i]
            code = 0
            for bit in range(8):
                code |= int(flat[place + steps[bit]]) << bit
            if REMOVABLE[code] >> turn & 1:
                gone[removed] = place
                removed += 1
            else:
                places[kept] = place
                kept += 1
        for i in range(removed):
            flat[gone[i]] = 0
        count, turn = kept, 1 - turn
        idle = 0 if removed else idle + 1
    return thin


@compiled
def free_lines(thin: NDArray[np.uint8], radii: NDArray[np.float32], least: float) -> tuple[Ints, Ints]:
    """Return the lines of a skeleton from each free end to the junction with others, without insignificant ones.

    Args:
        thin: (height, width) 0 or 1; meaningless lines are taken away in place.
        radii: (height, width) distance of each pixel inside from the edge, px.
        least: Least extension of a line beyond the disc at its junction, px; lines with less, or less than a third of
            the disc's radius, are insignificant.

    Returns:
        The pixels (n, 2), column and row, of all lines one after another, each from its end; and where each line begins
        and the last one ends, (lines + 1,).
    """
    most = np.count_nonzero(thin)
    found, begins = np.empty((2 * most + 2, 2), np.int64), np.empty(most + 2, np.int64)
    while True:
        lines = _lines(thin, found, begins)
        worst, worst_gain = -1, 0.0
        for line in range(lines):
            first, last = begins[line], begins[line + 1] - 1
            column, row = found[last, 0], found[last, 1]
            if NEIGHBOURS[_code(thin, row, column)] < 2:  # another free end: there is only this line
                continue
            x, y = float(column - found[first, 0]), float(row - found[first, 1])
            gain = np.sqrt(x * x + y * y) + radii[found[first, 1], found[first, 0]] - radii[row, column]
            gain -= max(least, LEAST_GAIN_SHARE * radii[row, column])
            if gain < worst_gain:
                worst, worst_gain = line, gain
        if worst < 0:
            return found[: begins[lines]], begins[: lines + 1]
        _remove(thin, found[begins[worst] : begins[worst + 1]])


@compiled
def _lines(thin: NDArray[np.uint8], found: Ints, begins: Ints) -> int:
    """Write the pixels of all lines from their free ends on, and where each begins; return their number."""
    size, lines = 0, 0
    begins[0] = 0
    for row in range(1, thin.shape[0] - 1):
        for column in range(1, thin.shape[1] - 1):
            if thin[row, column] != 0 and CHANGES[_code(thin, row, column)] < 2:
                size += _follow(thin, row, column, found[size:])
                lines += 1
                begins[lines] = size
    return lines


@compiled
def _remove(thin: NDArray[np.uint8], line: Ints) -> None:
    """Remove a line (n, 2) except for its last pixel, and corners there that the rest does not need."""
    last = line.shape[0] - 1
    for i in range(last):
        thin[line[i, 1], line[i, 0]] = 0
    for row in range(line[last, 1] - 1, line[last, 1] + 2):
        for column in range(line[last, 0] - 1, line[last, 0] + 2):
            if thin[row, column] != 0 and REMOVABLE[_code(thin, row, column)]:
                thin[row, column] = 0


@compiled
def _code(thin: NDArray[np.uint8], row: int, column: int) -> int:
    """Return which neighbours of a pixel are set, as bits."""
    code = 0
    for bit in range(8):
        code |= int(thin[row + DOWN[bit], column + ACROSS[bit]]) << bit
    return code


@compiled
def _follow(thin: NDArray[np.uint8], row: int, column: int, found: Ints) -> int:
    """Write the pixels of a line from its end to a junction, or to its other end; return their number."""
    length, before_row, before_column = 0, -1, -1
    while length < found.shape[0]:
        found[length, 0], found[length, 1] = column, row
        length += 1
        if length > 1 and CHANGES[_code(thin, row, column)] != 2:
            break
        # Straight neighbours come first, so a corner is followed and not cut; the previous pixel is excluded.
        next_row, next_column = -1, -1
        for bit in (0, 2, 4, 6, 1, 3, 5, 7):
            r, c = row + DOWN[bit], column + ACROSS[bit]
            if thin[r, c] != 0 and (length < 2 or max(abs(r - before_row), abs(c - before_column)) > 1):
                next_row, next_column = r, c
                break
        if next_row < 0:
            break
        before_row, before_column, row, column = row, column, next_row, next_column
    return length
