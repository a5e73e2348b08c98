"""Silhouettes, what is seen of a hand in them, and the open hand to begin with."""

from collections.abc import Iterator
from itertools import pairwise
from typing import Any

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

from pftrack.core.model.parameters import revise
from pftrack.core.model.source import Frame, History
from pftrack.core.numerics.compiled import read_only
from pftrack.core.numerics.elementary import wrap
from pftrack.core.refusal import RefusedError
from pftrack.experiments.hand.fingers import HandFeatures, features_in, features_of, resample
from pftrack.experiments.hand.first_pose import FlatHand, OpenHand, disagreement, find_open_hand, fit_hand
from pftrack.experiments.hand.recording import EVENTS, propose
from pftrack.experiments.hand.scene import HandSceneParameters, HandSource, HandTarget
from pftrack.experiments.hand.shape import MODEL, joints, open_pose, silhouette
from pftrack.experiments.hand.silhouette import (
    NORMAL_SD,
    Finding,
    Silhouette,
    SilhouetteParameters,
    backdrop_model,
    contacts,
    differs,
    doubtful,
    free_lines,
    silhouette_of,
    skeleton,
    suggest_parameters,
)

Picture = NDArray[np.uint8]
SKIN, WALL = (224, 172, 138), (90, 110, 120)
DEFAULTS = SilhouetteParameters()


def hand(side: int = 200, ground: Any = (16, 20, 24), colour: Any = SKIN) -> tuple[Picture, NDArray[np.bool_]]:
    mask = silhouette(open_pose((side / 2, 0.685 * side)), 0.25 * side, MODEL, (side, side))
    return np.where(mask[..., None], np.array(colour, np.uint8), np.array(ground, np.uint8)), mask


def found(image: Picture, **values: object) -> Any:
    return silhouette_of(image, revise(DEFAULTS, values))


@pytest.mark.parametrize(
    ("values", "ground", "colour"),
    [
        ({"tells_by": "light"}, (16, 20, 24), SKIN),
        ({"tells_by": "dark"}, (230, 235, 225), (60, 40, 30)),
        ({"tells_by": "skin"}, WALL, SKIN),
        ({"tells_by": "skin"}, WALL, (92, 60, 42)),
        ({"tells_by": "background"}, WALL, SKIN),
    ],
)
def test_a_hand_is_told_from_the_rest(values: dict[str, object], ground: Any, colour: Any) -> None:
    """By brightness, by skin of any tone, and by what differs from the border, to the pixel."""
    image, mask = hand(ground=ground, colour=colour)
    seen = found(image, **values)
    assert seen.finding is Finding.CLEAR
    assert seen.reduction == 1
    assert np.array_equal(seen.mask, mask)


def test_what_cannot_be_a_hand_is_said_in_words() -> None:
    """Nothing, a flash, two hands, and a hand beyond the border; each has a sentence."""
    image, mask = hand()
    two = np.hstack([image, image[:, ::-1]])
    cut = np.roll(image, -45, axis=0)
    cut[150:] = image[150:]
    empty, full = np.zeros_like(image), np.full_like(image, 255)
    for picture, expected in ((empty, Finding.EMPTY), (full, Finding.FULL), (two, Finding.SEVERAL), (cut, Finding.CUT)):
        seen = found(picture)
        assert seen.finding is expected
        assert len(expected.value) > 20
        assert seen.mask.shape == tuple(side // seen.reduction for side in picture.shape[:2])
    speck = empty.copy()
    speck[50:58, 50:58] = 255
    assert found(speck).finding is Finding.EMPTY
    assert mask.any()


def test_smaller_things_beside_the_hand_are_left_out_and_pin_holes_filled() -> None:
    """Only the largest connected thing counts; a hole of a few pixels is none."""
    image, mask = hand()
    image[20:40, 10:30] = 255
    image[120:124, 100:104] = 0
    seen = found(image)
    assert seen.finding.ok
    assert np.array_equal(seen.mask, mask)
    image[105:120, 95:105] = 0
    assert found(image).mask.sum() == mask.sum() - 166


def test_large_pictures_are_made_smaller_by_a_whole_factor() -> None:
    """4,000 x 4,000 px come down to 250 x 250; places go to the picture and back."""
    image, mask = hand(1000)
    huge = np.repeat(np.repeat(image, 4, axis=0), 4, axis=1)
    seen = found(read_only(huge))
    assert seen.reduction == 16
    assert seen.mask.shape == (250, 250)
    small = cv2.resize(mask.astype(np.float32), (250, 250), interpolation=cv2.INTER_AREA) > 0.4
    assert (seen.mask != small).mean() < 0.01
    places = np.array([[0.0, 0.0], [249.0, 100.0]])
    assert seen.in_picture(places).tolist() == [[7.5, 7.5], [3991.5, 1607.5]]
    assert seen.in_mask(seen.in_picture(places)) == pytest.approx(places)


def test_features_of_the_last_pictures_are_kept() -> None:
    """The same read-only picture gives the same object; one that may be written is looked at again."""
    image, _ = hand()
    assert features_of(read_only(image), DEFAULTS) is not features_of(image, DEFAULTS)
    kept = read_only(image)
    assert features_of(kept, DEFAULTS) is features_of(kept, DEFAULTS)


def test_contacts_are_counted_around_the_border() -> None:
    """One through a corner is one; gaps of a few pixels do not count; all around is one."""
    mask = np.zeros((40, 60), np.bool_)
    assert contacts(mask).tolist() == []
    mask[:5, :7] = True
    assert contacts(mask).tolist() == [11]
    mask[39, [30, 31, 34, 35]] = True
    assert sorted(contacts(mask).tolist()) == [6, 11]
    mask[20:25, 59] = True
    assert len(contacts(mask)) == 3
    assert contacts(np.ones((40, 60), np.bool_)).tolist() == [196]


@pytest.mark.parametrize(
    ("ground", "colour", "tells_by"),
    [((0, 0, 0), (120, 120, 120), "light"), ((240, 240, 240), (70, 50, 40), "dark")],
)
def test_a_suggestion_tells_the_hand(ground: Any, colour: Any, tells_by: str) -> None:
    """Brightness where that is enough, with a level that leaves a hand its shadows."""
    image, mask = hand(ground=ground, colour=colour)
    values = suggest_parameters(image)
    assert values["tells_by"] == tells_by
    assert (found(image, **values).mask != mask).mean() < 0.005
    image[mask & (np.arange(200) < 90)] = (60, 60, 60) if tells_by == "light" else (150, 140, 130)
    assert (found(image, **suggest_parameters(image)).mask != mask).mean() < 0.005


def test_before_a_wall_of_many_colours_skin_is_suggested() -> None:
    """Where brightness does not fall into two classes."""
    wall = np.linspace(40, 240, 200)[None, :, None] * np.array([0.8, 1.0, 1.0])
    _, mask = hand()
    image = np.where(mask[..., None], SKIN, np.broadcast_to(wall, (200, 200, 3))).astype(np.uint8)
    values = suggest_parameters(image)
    assert values["tells_by"] == "skin"
    assert (found(image, **values).mask != mask).mean() < 0.02


def test_a_plain_picture_gets_a_suggestion_as_well() -> None:
    """Without anything in it there is nothing to tell, and nothing breaks."""
    for level in (0, 128, 255):
        image = np.full((60, 80, 3), level, np.uint8)
        assert not found(image, **suggest_parameters(image)).finding.ok


# What is behind the hand, pixel by pixel: a model over the pictures of a recording.

SIDE = 200
WOOD, BACKDROP_SKIN = np.array([150.0, 105.0, 75.0]), np.array([224.0, 172.0, 138.0])


class Clip:
    """Pictures that are there."""

    def __init__(self, *shown: Picture) -> None:
        self.shown = shown
        self.asked: list[int] = []

    def pictures(self, first: int) -> Iterator[Picture]:
        self.asked.append(first)
        return iter(self.shown[: first or len(self.shown)])


def wall(seed: int) -> Picture:
    """Return boards of wood, lighter and darker, which has the colours of skin, with noise of 3 grey levels."""
    boards = np.random.default_rng(1).uniform(0.1, 1.1, (SIDE // 8, SIDE // 8)).astype(np.float32)
    shade = cv2.resize(boards, (SIDE, SIDE), interpolation=cv2.INTER_NEAREST)
    noise = np.random.default_rng(seed).normal(0.0, 3.0, (SIDE, SIDE, 3))
    return np.clip(shade[..., None] * WOOD + noise, 0, 255).astype(np.uint8)


def with_hand(seed: int, column: float) -> tuple[Picture, NDArray[np.bool_]]:
    mask = silhouette(open_pose((column, 137.0)), 50.0, MODEL, (SIDE, SIDE))
    noise = np.random.default_rng(100 + seed).normal(0.0, 3.0, (SIDE, SIDE, 3))
    return np.where(mask[..., None], BACKDROP_SKIN + noise, wall(seed)).astype(np.uint8), mask


def test_the_median_and_its_deviation_are_those_of_each_pixel() -> None:
    """Of normal noise the deviation is that of the noise; a thing that passes by changes neither by much."""
    noise = np.random.default_rng(0).normal(100.0, 5.0, (25, 30, 40, 3)).astype(np.uint8)
    model = backdrop_model(Clip(*noise), 0, 1)
    assert (model.median_rgb == np.median(noise, axis=0)).all()
    assert model.sd_rgb.mean() == pytest.approx(5.0, rel=0.05)
    assert (model.sd_rgb % NORMAL_SD < 1e-4).mean() > 0.3  # whole grey levels of deviation
    passing = noise.copy()
    for place in range(25):
        passing[place, :, max(2 * place - 8, 0) : 2 * place] = 250
    assert backdrop_model(Clip(*passing), 0, 1).median_rgb.mean() == pytest.approx(model.median_rgb.mean(), abs=2.0)


def test_a_pixel_differs_by_so_much_or_by_four_deviations() -> None:
    """What varies by itself must differ by more, in one channel at least."""
    still, windy = np.full((10, 10, 3), 100, np.uint8), np.full((10, 10, 3), 100, np.uint8)
    windy[:, 5:, 1] = 80
    model = backdrop_model(Clip(still, windy, still, windy, np.full_like(still, 90)), 0, 1)
    assert np.unique(model.sd_rgb).round(3).tolist() == pytest.approx([0.0, 14.826], abs=1e-3)
    shown = still.copy()
    shown[..., 1] = 131
    away = differs(shown, model, 30)
    assert away[:, :5].all()
    assert not away[:, 5:].any()


@pytest.mark.parametrize("first", [4, 0])
def test_before_a_textured_wall_only_the_backdrop_tells_a_hand(first: int) -> None:
    """From pictures without the hand, or from a whole recording through which it moves; the border's colour fails."""
    if first:
        clip = Clip(*(wall(seed) for seed in range(first)), with_hand(9, 100.0)[0])
    else:
        clip = Clip(*(with_hand(seed, column)[0] for seed, column in enumerate(np.linspace(-60.0, 260.0, 13))))
    image, mask = with_hand(50, 100.0)
    seen = {}
    for way in ("light", "background", "skin", "backdrop"):
        given = revise(SilhouetteParameters(), {"tells_by": way, "backdrop_frames": first, "smoothing_px": 3})
        seen[way] = silhouette_of(image, given, clip)
    assert seen["backdrop"].finding is Finding.CLEAR
    assert (seen["backdrop"].mask != mask).mean() < 0.01
    for way in ("background", "skin"):
        assert not seen[way].finding.ok or (seen[way].mask != mask).mean() > 0.1, way
    assert clip.asked[-1] == first


def test_a_backdrop_is_suggested_where_nothing_else_tells_the_hand() -> None:
    """And not where the picture alone is enough; what then tells the hand is the model of the whole recording."""
    shown = [with_hand(seed, column)[0] for seed, column in enumerate(np.linspace(-60.0, 260.0, 13))]
    image, _ = with_hand(50, 100.0)
    assert suggest_parameters(image, Clip(*shown))["tells_by"] == "backdrop"
    dark = np.where(silhouette(open_pose((100.0, 137.0)), 50.0, MODEL, (SIDE, SIDE))[..., None], 220, 10)
    clip = Clip(*shown)
    assert suggest_parameters(dark.repeat(3, axis=2).astype(np.uint8), clip)["tells_by"] == "light"
    assert not clip.asked


def test_a_model_is_made_once_and_the_border_stands_in_where_there_is_none() -> None:
    """So live changes of other settings cost nothing, and simulated pictures have a silhouette as well."""
    clip = Clip(*(wall(seed) for seed in range(5)))
    settings = revise(SilhouetteParameters(), {"tells_by": "backdrop"})
    for seed in range(3):
        silhouette_of(read_only(with_hand(seed, 100.0)[0]), settings, clip)
    assert clip.asked == [0]
    image, _ = with_hand(0, 100.0)
    border = silhouette_of(image, revise(settings, {"tells_by": "background"}))
    assert np.array_equal(silhouette_of(image, settings).mask, border.mask)


@pytest.mark.parametrize("count", [1, 12])
def test_a_hand_that_never_moves_is_told_to_be_in_the_backdrop(count: int) -> None:
    """Of a clip of one picture as well: nothing differs, it is said why, and no backdrop is suggested."""
    clip = Clip(*(with_hand(seed, 100.0)[0] for seed in range(count)))
    given = revise(SilhouetteParameters(), {"tells_by": "backdrop", "smoothing_px": 4})  # 5: a median's side is odd
    found = silhouette_of(clip.shown[0], given, clip)
    assert found.finding is Finding.AS_BACKDROP
    assert not found.mask.any()
    assert suggest_parameters(clip.shown[0], clip)["tells_by"] != "backdrop"
    assert EVENTS[found.finding.value] == "no_hand"


def test_a_backdrop_is_in_doubt_where_a_hand_moves_a_little_in_every_picture() -> None:
    """Then what differs is a part of the hand, or of the wall that the median hides; one that passes by is clear."""
    columns = 100.0 + 24.0 * np.sin(np.arange(25.0))
    clip = Clip(*(with_hand(seed, column)[0] for seed, column in enumerate(columns)))
    given = revise(SilhouetteParameters(), {"tells_by": "backdrop", "smoothing_px": 3})
    image, mask = with_hand(50, 124.0)
    found = silhouette_of(image, given, clip)
    assert (found.mask != mask).mean() > 0.03
    assert found.finding is Finding.DOUBTFUL
    assert suggest_parameters(image, clip)["tells_by"] != "backdrop"
    passing = Clip(*(with_hand(seed, column)[0] for seed, column in enumerate(np.linspace(-60.0, 260.0, 25))))
    model = backdrop_model(passing, 0, 1)
    assert doubtful(model, 40)[mask].mean() < 0.07


def test_doubt_begins_where_fewer_than_seven_pictures_of_ten_agree() -> None:
    """In one channel at least, by as much as a pixel has to differ."""
    shown = np.full((10, 1, 10, 3), 100, np.uint8)
    for column in range(10):
        shown[:column, 0, column, 1] = 160
    model = backdrop_model(Clip(*shown), 0, 1)
    assert doubtful(model, 40)[0, :5].tolist() == [False, False, False, False, True]
    assert not doubtful(model, 70).any()


# Fingers, arm and wrist of silhouettes.


def seen(index: int = 0, seed: int = 0, **values: object) -> tuple[HandFeatures, HandTarget]:
    parameters = revise(HandSceneParameters(), {"motion": "bend", **values})
    frame: Frame = HandSource(seed, parameters).frame(index, History(((0, parameters),)))
    assert frame.image_rgb is not None
    assert isinstance(frame.target, HandTarget)
    return features_of(frame.image_rgb, DEFAULTS), frame.target


def of_mask(mask: NDArray[np.bool_]) -> HandFeatures:
    return features_in(Silhouette(mask, 1, Finding.CLEAR))


def test_the_fingers_of_an_open_hand_are_found_with_their_tips() -> None:
    """On twenty hands: five protrusions in most, tips within 1.5 px in the mean square, the wrist within 4 px."""
    tips, wrists, counts = [], [], []
    for seed in range(20):
        features, target = seen(0, seed)
        counts.append(len(features.protrusions))
        for axis, radii in features.protrusions:
            tips.append(np.hypot(*(axis[0] - target.tips).T).min())
            assert np.hypot(*np.diff(axis, axis=0).T) == pytest.approx(1.0, abs=0.35)
            assert axis.shape[0] == radii.shape[0] > 9
        if features.wrist is not None:
            wrists.append(features.wrist - target.pose[:2])
    assert sum(count == 5 for count in counts) >= 17
    assert np.sqrt(np.square(tips).mean()) < 1.6
    assert len(wrists) >= 18
    assert np.abs(np.mean(wrists, axis=0)).max() < 3.0
    assert np.std(wrists, axis=0).max() < 4.0


@pytest.mark.parametrize("turn", [-120, -60, 45, 90, 180])
def test_features_turn_with_the_hand(turn: float) -> None:
    """With the arm from the side or from above there are as many fingers, and the wrist is where it is."""
    features, target = seen(0, 4, turn_deg=turn)
    assert features.finding.ok
    assert len(features.protrusions) == 5
    assert np.hypot(*(features.wrist - target.pose[:2])) < 7.0
    for axis, _ in features.protrusions:
        assert np.hypot(*(axis[0] - target.tips).T).min() < 3.0


def test_folded_fingers_are_no_protrusions() -> None:
    """In the middle of the occlusion thumb, index and little finger are left."""
    features, target = seen(9, 3, motion="occlusion")
    assert len(features.protrusions) == 3
    nearest = {int(np.hypot(*(axis[0] - target.tips).T).argmin()) for axis, _ in features.protrusions}
    assert nearest == {0, 1, 4}


def test_an_arm_as_broad_as_the_hand_is_an_arm_still() -> None:
    """However broad, its skeleton crosses the border, and it is taken for no finger."""
    mask = np.zeros((200, 200), np.bool_)
    mask[60:, 50:140] = True
    mask[15:70, 80:100] = True
    features = of_mask(mask)
    assert len(features.protrusions) == 1
    assert features.wrist is None


def test_a_fist_on_its_arm_is_no_finger() -> None:
    """It is one line from end to end, which is the arm's; the wrist is where the disc begins."""
    mask = np.zeros((200, 200), np.bool_)
    rows, columns = np.indices(mask.shape)
    mask[np.hypot(rows - 90, columns - 100) < 32] = True
    mask[90:, 88:112] = True
    features = of_mask(mask)
    assert features.protrusions == ()
    assert features.wrist is not None
    assert features.wrist == pytest.approx([99.5, 119.5], abs=8)


def test_a_silhouette_that_cannot_be_a_hand_has_no_features() -> None:
    """Nothing is made of it, and nothing is not a number."""
    for finding in (Finding.EMPTY, Finding.FULL, Finding.SEVERAL, Finding.CUT):
        features = features_in(Silhouette(np.ones((40, 40), np.bool_), 1, finding))
        assert features.protrusions == ()
        assert features.wrist is None
        assert features.finding is finding


@pytest.mark.parametrize("kind", ["disc", "noise", "line", "all but a pixel", "ring"])
def test_other_things_are_looked_at_without_fault(kind: str) -> None:
    """Whatever is connected gives finite features."""
    mask = np.zeros((120, 120), np.bool_)
    rows, columns = np.indices(mask.shape)
    away = np.hypot(rows - 60, columns - 60)
    if kind == "disc":
        mask = away < 40
    elif kind == "noise":
        mask = np.random.default_rng(1).random(mask.shape) < 0.7
    elif kind == "line":
        mask[60, 10:] = True
    elif kind == "ring":
        mask = (away < 50) & (away > 30)
    else:
        mask[:] = True
        mask[5, 5] = False
    features = of_mask(mask)
    for axis, radii in features.protrusions:
        assert np.isfinite(axis).all()
        assert np.isfinite(radii).all()
    assert kind not in {"disc", "ring"} or not features.protrusions


def test_lines_are_resampled_by_arc_length() -> None:
    """Points of a bent line are a px apart along it; values go along."""
    line = np.array([[0.0, 0.0], [3.0, 0.0], [3.0, 2.5]])
    points, values = resample(line, np.array([0.0, 3.0, 5.5]))
    assert points.tolist() == [[0, 0], [1, 0], [2, 0], [3, 0], [3, 1], [3, 2]]
    assert values == pytest.approx(np.arange(6.0))


# Skeletons and their free lines.

Mask = NDArray[np.uint8]


def lines(mask: Mask, least: float = 2.5) -> list[NDArray[np.int64]]:
    radii = np.asarray(cv2.distanceTransform(mask, cv2.DIST_L2, cv2.DIST_MASK_PRECISE), np.float32)
    pixels, begins = free_lines(skeleton(mask), radii, least)
    return [pixels[first:last] for first, last in pairwise(begins)]


def blobs(number: int) -> Mask:
    noise = np.random.default_rng(number).normal(size=(90, 120)).astype(np.float32)
    mask = np.asarray(cv2.GaussianBlur(noise, (0, 0), 5) > 0, np.uint8)
    mask[[0, -1]] = 0
    mask[:, [0, -1]] = 0
    return mask


def test_a_bar_becomes_its_middle_line() -> None:
    """Of a bar 9 px wide one row is left, nearly as long as the bar."""
    mask = np.zeros((40, 120), np.uint8)
    mask[15:24, 10:110] = 1
    thin = skeleton(mask)
    rows, columns = np.nonzero(thin[:, 20:100])
    assert (rows == 19).all()
    assert len(columns) == 80
    found = lines(mask)
    # Both ends are free, and the whole line belongs to either.
    assert len(found) == 2
    assert found[0][0].tolist() == found[1][-1].tolist()
    assert abs(len(found[0]) - 92) < 5


@pytest.mark.parametrize("number", range(3))
def test_thinning_keeps_what_is_connected(number: int) -> None:
    """As many parts and as many holes are left as there were, and no block of four pixels that could be thinner."""
    mask = blobs(number)
    thin = skeleton(mask)
    assert (thin <= mask).all()
    for connectivity, before, after in ((8, mask, thin), (4, 1 - mask, 1 - thin)):
        counts = [
            cv2.connectedComponents(np.asarray(each, np.uint8), connectivity=connectivity)[0]
            for each in (before, after)
        ]
        assert counts[0] == counts[1]
    blocks = thin[:-1, :-1] + thin[1:, :-1] + thin[:-1, 1:] + thin[1:, 1:]
    assert (blocks == 4).mean() < 0.001


@pytest.mark.parametrize("number", range(3))
def test_taking_lines_away_keeps_the_rest_connected(number: int) -> None:
    """The parts stay as many; every line that is left adds enough, unless it is all there is."""
    mask = blobs(number)
    radii = np.asarray(cv2.distanceTransform(mask, cv2.DIST_L2, cv2.DIST_MASK_PRECISE), np.float32)
    thin = skeleton(mask)
    pixels, begins = free_lines(thin, radii, 3.0)
    assert cv2.connectedComponents(thin)[0] == cv2.connectedComponents(mask)[0]
    for first, last in pairwise(begins):
        steps = np.abs(np.diff(pixels[first:last], axis=0)).max(axis=1)
        assert (steps == 1).all()
        column, row = pixels[last - 1]
        if thin[row - 1 : row + 2, column - 1 : column + 2].sum() > 2:
            away = np.hypot(*(pixels[last - 1] - pixels[first]))
            assert away + radii[pixels[first, 1], pixels[first, 0]] - radii[row, column] >= 3.0


def test_a_cross_has_four_lines_and_a_bump_none() -> None:
    """Lines run from the ends to where they meet; a bump of the edge adds too little."""
    mask = np.zeros((100, 100), np.uint8)
    mask[46:54, 10:90] = 1
    mask[10:90, 46:54] = 1
    mask[44:46, 20:24] = 1
    found = lines(mask)
    assert len(found) == 4
    ends = sorted(tuple(line[0]) for line in found)
    assert [max(abs(x - 50), abs(y - 50)) > 30 for x, y in ends] == [True] * 4
    assert all(np.hypot(*(line[-1] - 49.5)) < 5 for line in found)


@pytest.mark.parametrize("shape", [(3, 3), (3, 40), (12, 12)])
def test_an_empty_mask_and_a_full_one(shape: tuple[int, int]) -> None:
    """Nothing has no lines; all of a small picture becomes a line or a point."""
    assert lines(np.zeros(shape, np.uint8)) == []
    mask = np.zeros(shape, np.uint8)
    mask[1:-1, 1:-1] = 1
    assert skeleton(mask).sum() >= 1
    assert len(lines(mask)) <= 2


# The first pose: an open hand found by itself, or by five marked tips.


def errors(found: OpenHand, target: HandTarget) -> tuple[float, float, float, float]:
    """Of tips and wrist in palm axes, of size as a share, and of the turn in rad."""
    tips = joints(found.pose, found.scale, found.shape)[:, 3, :2]
    return (
        float(np.hypot(*(tips - target.tips).T).mean() / target.scale),
        float(np.hypot(*(found.pose[:2] - target.pose[:2])) / target.scale),
        abs(found.scale / target.scale - 1),
        abs(float(wrap(found.pose[2] - target.pose[2]))),
    )


CASES = [
    {"turn_deg": turn, "hand": hand, "palm_axis_px": size, "proportions": share}
    for turn, hand, size, share in [
        (0, "right", 52, 0.04),
        (35, "left", 60, 0.08),
        (90, "right", 46, 0.12),
        (-90, "left", 52, 0.04),
        (150, "right", 44, 0.08),
        (180, "left", 56, 0.04),
        (-140, "right", 48, 0.04),
        (-45, "left", 40, 0.08),
    ]
]


def test_open_hands_are_begun_by_themselves() -> None:
    """Of other people, sizes, sides and turns, with arms from all sides: tips within 5 %, sizes within 8 %."""
    found = []
    for number, values in enumerate(CASES):
        features, target = seen(0, 500 + number, **values)
        hand = find_open_hand(features)
        assert hand.shape.side == target.shape.side
        assert ("a left palm" in " ".join(hand.remarks)) == (target.shape.side < 0)
        assert ("from above" in " ".join(hand.remarks)) == (abs(values["turn_deg"]) > 120)  # type: ignore[operator, arg-type]
        assert hand.misfit < 0.15
        found.append(errors(hand, target))
    assert np.max(found, axis=0) == pytest.approx(0, abs=0.11)
    assert np.mean(found, axis=0)[0] < 0.035
    assert np.mean(found, axis=0)[1] < 0.06
    assert np.mean(found, axis=0)[2] < 0.04
    assert np.mean(found, axis=0)[3] < 0.035


def test_the_persons_fingers_are_measured() -> None:
    """Lengths within 8 % of this hand's, widths within 12 %."""
    features, target = seen(0, 3, proportions=0.1)
    hand = find_open_hand(features)
    lengths = hand.scale * hand.shape.phalanges.sum(axis=1) / (target.scale * target.shape.phalanges.sum(axis=1))
    widths = hand.scale * hand.shape.radii.mean(axis=1) / (target.scale * target.shape.radii.mean(axis=1))
    assert lengths == pytest.approx(1.0, abs=0.08)
    assert widths == pytest.approx(1.0, abs=0.12)
    assert hand.shape.arm[0] == pytest.approx(MODEL.arm[0], rel=0.12)


@pytest.mark.parametrize(
    ("index", "values", "reason"),
    [
        (29, {}, "seen"),
        (21, {}, "fingers are seen"),
        (27, {"motion": "wrist"}, "fingers are seen"),
        (8, {"motion": "occlusion"}, "3 fingers are seen"),
        (0, {"occlusion_width_px": 400}, Finding.EMPTY.value),
        (4, {"flash_every": 5}, Finding.FULL.value),
        (0, {"palm_axis_px": 20, "picture_side_px": 120}, "seen|small"),
    ],
)
def test_what_cannot_be_begun_is_said_in_words(index: int, values: dict[str, object], reason: str) -> None:
    """A fist, a hand from its side, folded fingers, nothing, a flash, and a hand of a few pixels."""
    features, _ = seen(index, 3, **values)
    with pytest.raises(RefusedError, match=reason):
        find_open_hand(features)


def test_a_hand_in_a_huge_picture_is_begun_in_its_pixels() -> None:
    """4,000 x 4,000 px: pose and size are those of the large picture."""
    mask = silhouette(open_pose((1000, 1370)), 520.0, MODEL, (2000, 2000))
    image = np.repeat(np.repeat(mask, 2, axis=0), 2, axis=1)[..., None].astype(np.uint8) * np.uint8(200)
    hand = find_open_hand(features_of(read_only(np.repeat(image, 3, axis=2)), DEFAULTS))
    assert hand.scale == pytest.approx(1040, rel=0.03)
    assert hand.pose[:2] == pytest.approx([2000.5, 2740.5], abs=50)
    assert hand.misfit < 0.08


def test_marks_give_what_is_seen_its_names() -> None:
    """With all tips marked an open hand is the one that is found without."""
    features, target = seen(0, 6)
    alone, marked = find_open_hand(features), find_open_hand(features, target.tips)
    assert errors(marked, target)[0] < 0.05
    assert marked.scale == pytest.approx(alone.scale, rel=0.06)
    assert marked.shape.side == alone.shape.side == 1.0


def test_folded_fingers_may_be_marked() -> None:
    """With two fingers folded, marks begin what cannot be begun by itself."""
    features, target = seen(10, 3, motion="occlusion", hand="left")
    with pytest.raises(RefusedError):
        find_open_hand(features)
    hand = find_open_hand(features, target.tips)
    tips, wrist, size, turn = errors(hand, target)
    assert hand.shape.side == -1.0
    assert tips < 0.15
    assert wrist < 0.15
    assert size < 0.12
    assert turn < 0.12
    assert (hand.pose[[14, 18]] > 0.6).all()
    assert (hand.pose[[10, 22]] == 0).all()


def test_marks_beside_the_fingers_are_refused() -> None:
    """At least two belong to fingers that are seen."""
    features, target = seen(0, 6)
    with pytest.raises(RefusedError, match="marked tips"):
        find_open_hand(features, target.tips + np.array([60.0, 50.0]))


def test_a_fit_finds_a_hand_that_is_known() -> None:
    """From five per cent beside it, to within 2 %; the disagreement of a hand with itself is nothing."""
    known = FlatHand(open_pose((100.0, 137.0), 0.1), 52.0, MODEL)
    mask = silhouette(known.pose, known.scale, known.shape, (200, 200))
    assert disagreement(mask, np.ones_like(mask), known.pose, known.scale, known.shape) == 0
    beside = known._replace(pose=known.pose + np.array([2.0, -2.0, 0.05] + 22 * [0.0]), scale=54.0)
    hand, misfit, _ = fit_hand(mask, beside)
    assert misfit < 0.05
    assert hand.scale == pytest.approx(52.0, rel=0.025)
    assert hand.pose[2] == pytest.approx(0.1, abs=0.02)


@pytest.mark.parametrize(("raised", "side"), [((1, 2), -1.0), ((0, 4), 1.0), ((1, 2, 3), 1.0), ((0, 1, 2), -1.0)])
def test_fewer_fingers_are_proposed_and_not_taken_for_sure(raised: tuple[int, ...], side: float) -> None:
    """With the others folded the fingers that people raise together are told; a person is asked all the same."""
    shape = MODEL.with_changes(side=side)
    pose = open_pose((100.0, 137.0), 0.2)
    for finger in set(range(5)) - set(raised):
        pose[6 + 4 * finger : 9 + 4 * finger] = 1.25 if finger else 0.7
    mask = silhouette(pose, 52.0, shape, (200, 200))
    features = features_of(np.repeat(mask[..., None], 3, axis=2).astype(np.uint8) * np.uint8(255), DEFAULTS)
    found = propose(features)
    assert found.seen == tuple(finger in raised for finger in range(5))
    assert "drag the tips" in found.remarks[0]
    tips = joints(pose, 52.0, shape)[:, 3, :2]
    assert np.hypot(*(found.tips - tips).T)[list(raised)].max() < 4.0
    assert np.hypot(*(found.tips - tips).T).max() < 40.0


def test_an_open_hand_needs_no_proposal_and_a_fist_has_none() -> None:
    """All five are seen; of one finger or none there is nothing to propose, for the reason that there is no hand."""
    features, target = seen(0, 6)
    found = propose(features)
    assert found.seen == (True,) * 5
    assert np.hypot(*(found.tips - target.tips).T).max() < 5.0
    for values in ({"occlusion_width_px": 400}, {"flash_every": 1}):
        with pytest.raises(RefusedError):
            propose(seen(0, 6, **values)[0])
    with pytest.raises(RefusedError, match="finger is seen"):
        propose(seen(29, 3)[0])
