"""A chain of three links, whose lengths and pose are estimated from one camera (Shimada 1997).

Depth is not visible, so a link may point away from the camera or towards it, and a long link that is turned away looks
like a short one. Bounds on joints and lengths make the problem tractable. Kalman filters cut their Gaussian by these
bounds, and several of them together follow both sides of an ambiguity; set membership keeps regions of all possible
states.
"""

import math
from collections.abc import Callable, Mapping, Sequence
from itertools import pairwise
from pathlib import Path
from typing import Any, ClassVar, TypeAlias

import cv2
import numpy as np
from numpy.typing import NDArray

from pftrack.core.arrays import Floats
from pftrack.core.model.drawing import Drawing, Picture, Primitive
from pftrack.core.model.marks import FeaturePoints
from pftrack.core.model.measures import EvaluatedRun, held_at_end
from pftrack.core.model.parameters import Value, parameter, revise
from pftrack.core.model.series import SeriesValue
from pftrack.core.model.setup import Setup
from pftrack.core.model.source import Frame, FrameSequence, History, Target, Truth
from pftrack.core.model.tracker import Diagnostics, Step
from pftrack.core.numerics.elementary import direction, wrap
from pftrack.core.numerics.matrices import product
from pftrack.core.refusal import ParameterError
from pftrack.experiments.declared import read_words
from pftrack.experiments.experiment import PICTURES, Experiment, Judge, Measured, Video
from pftrack.experiments.linkage import scene
from pftrack.experiments.linkage.draw import (
    depth_world,
    draw_belief,
    draw_measurements,
    lengths_world,
    second_run,
    truth,
)
from pftrack.experiments.linkage.model import LINKS
from pftrack.experiments.linkage.state import LinkageParameters, LinkageState, SimulatedLinkageParameters
from pftrack.experiments.linkage.trackers import TRACKERS, Region, contains
from pftrack.experiments.shared.recording import OccluderParameters, RecordedFrames, paint_strip, strip
from pftrack.experiments.shared.sketch import caption, error_words
from pftrack.filters.beam import Beam
from pftrack.sources.tracks import TrackSequence
from pftrack.vision.matching import LARGEST_TEMPLATE_PX, cut, match

# A recording of a chain: the user marks root, joints and tip, and pftrack estimates lengths and depth from then on.
#
# All lengths are in px of the picture, as an orthographic camera has no other unit. The mark is the only prior
# knowledge: a link is at least as long as it looks there, and at most twice as long; the joints may bend either way.
# Users can set tighter bounds, live. Where the truth is known, the errors of directions are measured, and whether the
# truth was ever excluded.
#
# Four points of a chain on a recording: followed from the user's marks, or the tracks of a table.
#
# Each point has a template, cut anew after every match, since the surroundings of a joint turn as the chain moves; to
# avoid drift, the first template decides where it still fits nearby. A point whose best match is bad, or that touches
# the edge, has no match in that picture, and is searched again around its last place.

LAST_FRAMES = 6
"""Over which Shimada's success of a crossing is judged."""

HELD_AT_END = held_at_end(LAST_FRAMES)
"""Whether a chain came through: in between a wrong hypothesis may be ahead."""

MATCHING = "Following"
POINTS = 4
NEARBY_PX = 3
"""Distance from a match within which the first template is searched."""

FOLLOWED_SD_PX = 1.0
TILT = 0.5
"""Slope of the plane in which a chain is taken to lie at first, along the way from root to tip."""

Points: TypeAlias = tuple[Floats, Floats]
"""(4, 2) positions in the picture, px, NaN where they are not known, and (4, 2) standard deviations."""


class FollowingParameters(OccluderParameters, group=MATCHING):
    """Parameters for following marked points, and the overlay of the recording."""

    template_px: int = parameter(15, "Template", unit="px", within=(5, LARGEST_TEMPLATE_PX, 2), live=False)
    """Side of the square about a point that is searched in later pictures."""
    search_reach_px: int = parameter(16, "Search to", unit="px", within=(2, 40, 1), live=False)
    """Distance from its last match within which a point is searched, to all four sides."""
    largest_cost: float = parameter(0.5, "Largest cost", within=(0, 2, 0.05), live=False)
    """One minus the correlation beyond which a match is none; 2 takes all."""


class Followed:
    """Marked points through a recording, each picture looked at once, in order."""

    def __init__(self, sequence: FrameSequence, first: int, points: Floats, parameters: FollowingParameters) -> None:
        """Take up points (4, 2) in the picture `first`."""
        self._sequence, self._first, self._parameters = sequence, first, parameters
        self._size = parameters.template_px // 2 * 2 + 1
        self._places = np.rint(points).astype(np.int64)
        self._original = self._templates = cut(self._grey(0), self._places, self._size)
        # Marks between pixels keep their fraction.
        self._within = points - self._places
        self._found = [points]

    def at(self, index: int) -> Points:
        """Return the points in the picture `first + index`; the same index gives the same, in whatever order."""
        while len(self._found) <= index:
            self._found.append(self._next(self._grey(len(self._found))))
        return self._found[index], np.full((POINTS, 2), FOLLOWED_SD_PX)

    def _grey(self, index: int) -> NDArray[np.uint8]:
        return np.asarray(cv2.cvtColor(self._sequence.picture(self._first + index), cv2.COLOR_RGB2GRAY), np.uint8)

    def _next(self, grey: NDArray[np.uint8]) -> Floats:
        most, half = self._parameters.largest_cost, self._size // 2
        found = match(grey, self._templates, self._places, self._parameters.search_reach_px, "correlation")
        again = match(grey, self._original, found.places, NEARBY_PX, "correlation")
        original = again.costs <= np.minimum(found.costs + most / 2.0, most)
        places = np.where(original[:, None], again.places, found.places)
        offsets = np.where(original[:, None], again.offsets, found.offsets)
        inside = ((places > half) & (places < np.array(grey.shape[::-1]) - 1 - half)).all(axis=1)
        good = inside & (np.minimum(found.costs, again.costs) <= most)
        self._places = np.where(good[:, None], places, self._places)
        self._templates = np.where(good[:, None, None], cut(grey, self._places, self._size), self._templates)
        return np.where(good[:, None], places + offsets + self._within, np.nan)


def track_points(sequence: TrackSequence, columns: list[int], first: int) -> Callable[[int], Points]:
    """Return four of the tracks of a table, by number of the frame from the frame `first` on."""

    def at(index: int) -> Points:
        number = first + index
        return sequence.positions[number][columns], np.sqrt(sequence.variances[number][columns])

    return at


class RecordedLinkage(RecordedFrames):
    """The frames of a recording with four points of a chain in each; `start` is guessed from those of the first."""

    def __init__(
        self, sequence: FrameSequence, first: int, start: scene.LinkageTarget, at: Callable[[int], Points]
    ) -> None:
        """Wire a recording up from the picture `first` on.

        Args:
            sequence: The pictures.
            first: Number of the first picture used.
            start: First guess of the chain there.
            at: Number of the frame -> the points.
        """
        super().__init__(sequence, first, start)
        self._at = at

    def frame(self, index: int, history: History[FollowingParameters]) -> Frame:
        """Return a picture and the points in it; the same arguments give the same frame, to the bit."""
        parameters = history.at(index)
        image = self._sequence.picture(self._first + index)
        if parameters.occlusion_width_px > 0:
            image = image.copy()
            paint_strip(image, parameters)
            image.flags.writeable = False
        points, sd = self._at(index)
        left, right = strip(parameters, self.size[0])
        seen = np.isfinite(points).all(axis=1) & ~((left <= points[:, 0]) & (points[:, 0] < right))
        measured = scene.measure_points(points, sd, seen)
        return Frame(index, float(self._times_s[index]), image_rgb=image, measurements=measured)


def guess(points: Floats) -> scene.LinkageTarget:
    """Return a chain in space that is seen at four points (4, 2), px.

    Any plane that is not seen edge-on holds such a chain. The chosen one slopes away from the camera from root to tip:
    parallel to the image, its turn would not matter to first order.
    """
    across = points - points[0]
    chord = across[-1] if np.square(across[-1]).sum() > 0.0 else across[1]
    chord = chord / np.sqrt(np.square(chord).sum())
    places = np.column_stack([across, TILT * (across * chord).sum(axis=1)])
    links = np.diff(places, axis=0)
    lengths = np.sqrt(np.square(links).sum(axis=1))
    normal = np.cross(np.append(chord, TILT), np.array([-chord[1], chord[0], 0.0]))
    normal = normal / np.sqrt(np.square(normal).sum())
    along = links[0] / lengths[0]
    reference = np.column_stack([along, np.cross(normal, along), normal])
    flat = product(links, reference)
    directions = np.array([direction(x, y) for x, y in flat[:, :2].tolist()])
    theta = np.diff(np.append(0.0, directions))
    theta = theta - 2.0 * np.pi * np.round(theta / (2.0 * np.pi))
    theta[0] = 0.0
    position = np.concatenate([np.zeros(5), theta, lengths])
    return scene.LinkageTarget(
        scene.in_degrees(position),
        size=float(np.ptp(points, axis=0).max()),
        hidden=None,
        theta=theta,
        r=lengths,
        omega=np.zeros(3),
        t=np.zeros(2),
        reference=reference,
        origin_px=points[0],
    )


SHORTEST_PX = 4.0
"""A link that looks shorter in the marked picture gives no information on its length."""

LEAST_SHARE, MOST_SHARE = 0.85, 2.0
"""Bounds of a link's true length, relative to its marked length."""

LONGEST_PX = 2000.0
"""Greatest bound of a length that can be set."""

NEAR_PX = 12.0
"""Largest distance of a table's track from a mark."""


class LinkagePoints(FeaturePoints):
    """Root, joints and tip of a chain of three links."""

    title: ClassVar[str] = "Joints"
    instruction: ClassVar[str] = (
        "Drag the points to the root, which is the first joint, the other two joints and the tip."
    )
    features: ClassVar[Mapping[str, str]] = {name: name[:1].upper() + name[1:] for name in scene.NAMES}
    joined: ClassVar[tuple[tuple[str, str], ...]] = tuple(pairwise(scene.NAMES))
    offered: ClassVar[Mapping[str, tuple[float, float]]] = {
        name: (x, 0.5) for name, x in zip(scene.NAMES, np.linspace(0.3, 0.7, len(scene.NAMES)).tolist(), strict=True)
    }

    def check(self, size: tuple[int, int]) -> None:
        """Refuse points outside the picture, a point that is not marked, and a link without length."""
        super().check(size)
        for name in scene.NAMES:
            if name not in self.points:
                raise ParameterError(f"mark.points.{name}", None, "marked: root, both joints and the tip are needed")
        apart = np.sqrt(np.square(np.diff(self.places, axis=0)).sum(axis=1))
        for name, length in zip(scene.NAMES[1:], apart.tolist(), strict=True):
            if length < SHORTEST_PX:
                bound = f"at least {SHORTEST_PX:g} px from the point before it, so that the link is visible"
                raise ParameterError(f"mark.points.{name}", self.points[name], bound)

    @property
    def places(self) -> Floats:
        """(4, 2) of the points in their order, px."""
        return np.array([self.points[name] for name in scene.NAMES])

    @classmethod
    def of_target(cls, target: Target) -> "LinkagePoints | None":
        """Return the points of a chain that is known, if all its links can be seen."""
        mark = super().of_target(target)
        if mark is None or len(mark.points) < len(scene.NAMES):
            return None
        apart = np.square(np.diff(mark.places, axis=0)).sum(axis=1)
        return mark if bool((apart >= SHORTEST_PX**2).all()) else None


class RecordedLinkageParameters(LinkageParameters, FollowingParameters):
    """A recording of a chain, and its trackers."""


WANTED = "points: root, both joints and tip"


def wire(sequence: FrameSequence, mark: LinkagePoints | None, start: int, truth: Truth | None) -> Setup:
    """Wire a recording of a chain.

    Args:
        sequence: Pictures in which the points are followed, or a table of tracks, where four are used.
        mark: The points in the picture `start`. A table of the four points alone, in their order, needs none.
        start: Number of the picture to start at.
        truth: Not used; no truth of a chain can be brought in.

    Raises:
        ParameterError: No track is at a mark, or a table of other points lacks marks.
    """
    del truth
    if isinstance(sequence, TrackSequence):
        columns = _columns(sequence, mark, start)
        points = sequence.positions[start][columns]
        source = RecordedLinkage(sequence, start, guess(points), track_points(sequence, columns, start))
        defaults = revise(RecordedLinkageParameters(), _bounds(points))
        return Setup(lambda _seed, _parameters: source, defaults, success=HELD_AT_END.name)
    if mark is None:
        raise ParameterError("mark", None, WANTED)
    places = mark.places

    def open_source(_seed: int, parameters: RecordedLinkageParameters) -> RecordedLinkage:
        followed = Followed(sequence, start, places, parameters)
        return RecordedLinkage(sequence, start, guess(places), followed.at)

    return Setup(open_source, revise(RecordedLinkageParameters(), _bounds(places)), success=HELD_AT_END.name)


def _columns(sequence: TrackSequence, mark: LinkagePoints | None, start: int) -> list[int]:
    """Return which tracks of a table are root, joints and tip.

    Raises:
        ParameterError: A mark has no track, or it is not a mark of a chain, or the mark is missing and there are not
            exactly four visible tracks.
    """
    there = sequence.positions[start]
    if mark is None:
        if len(sequence.names) != len(scene.NAMES):
            bound = f"tracks of {len(scene.NAMES)} points, or marks at root, joints and tip that say which are meant"
            raise ParameterError("footage", len(sequence.names), bound)
        if not np.isfinite(there).all():
            raise ParameterError("start", start, "a frame in which all four points are seen")
        return list(range(len(scene.NAMES)))
    columns: dict[str, int] = {}
    for name, place in mark.points.items():
        apart = np.hypot(*(there - np.array(place)).T)
        apart[list(columns.values())] = np.nan
        nearest = int(np.nanargmin(apart)) if np.isfinite(apart).any() else -1
        if nearest < 0 or apart[nearest] > NEAR_PX:
            bound = f"within {NEAR_PX:g} px of a track that is seen in frame {start}, one for each point"
            if nearest >= 0:
                x, y = there[nearest].tolist()
                bound += f"; the nearest, {sequence.names[nearest]!r}, is at ({x:.1f}, {y:.1f})"
            if sequence.scale != 1.0:
                width, height = sequence.size
                bound += f" in px of the picture of {width} x {height} px, for which the table was scaled"
            raise ParameterError(f"mark.points.{name}", place, bound)
        columns[name] = nearest
    mark.check(sequence.size)
    return [columns[name] for name in scene.NAMES]


def _bounds(points: Floats) -> dict[str, Value]:
    """Return the parameters that follow from how long the links look where they are marked."""
    seen = np.sqrt(np.square(np.diff(points, axis=0)).sum(axis=1))
    low, high = np.clip(np.rint(np.outer((LEAST_SHARE, MOST_SHARE), seen)), 1.0, LONGEST_PX)
    values: dict[str, Value] = {}
    for link in range(len(seen)):
        values |= {f"length_{link + 1}_low_px": float(low[link]), f"length_{link + 1}_high_px": float(high[link])}
    spread = float(seen.mean())
    return {
        **values,
        "length_difference_12_px": LONGEST_PX,
        "length_difference_23_px": LONGEST_PX,
        "joint_low_deg": -360,
        "joint_high_deg": 360,
        "joint_difference_23_deg": 360,
        "start_angle_variance_rad2": 0.05,
        "start_length_variance_px2": max((0.3 * spread) ** 2, 1.0),
        "observation_variance_px2": 4,
        "root_acceleration_px": 3,
        "start_angle_bound_rad": 0.7,
        "start_length_bound_px": LONGEST_PX,
        "motion_bound_rad": 0.15,
        "error_bound_px": 4,
        "root_motion_bound_px": 16,
    }


IN_SPACE = 11
"""Numbers of an estimate in space: omega, t, theta and r."""
CLEARLY_RAD = np.deg2rad(20)
"""So far from the truth a direction must be for its mirror image to be another one."""


def direction_error(estimates: Floats, truths: Floats) -> Floats:
    """Return the greatest angle (...) between the believed and the true direction of a link, degrees.

    Args:
        estimates: (..., 6) or (..., 11), as trackers estimate them.
        truths: True values of the same shape, relative to the same reference attitude.
    """
    believed, true = (_unit_vectors(np.asarray(one, dtype=np.float64)) for one in (estimates, truths))
    across = np.linalg.norm(np.cross(believed, true), axis=-1)
    return np.asarray(np.rad2deg(np.arctan2(across, (believed * true).sum(axis=-1)).max(axis=-1)))


def _unit_vectors(positions: Floats) -> Floats:
    """Return the directions of the links (..., 3, 3), a link in each row."""
    absolute = np.deg2rad(np.cumsum(positions[..., -2 * LINKS : -LINKS], axis=-1))
    flat = np.stack([np.cos(absolute), np.sin(absolute), np.zeros_like(absolute)], axis=-1)
    if positions.shape[-1] != IN_SPACE:
        return flat
    omega = np.deg2rad(positions[..., None, :3])
    angle = np.linalg.norm(omega, axis=-1, keepdims=True)
    axis = np.divide(omega, angle, out=np.zeros_like(omega), where=angle > 0.0)
    axis = np.broadcast_to(axis, flat.shape)
    along = (axis * flat).sum(axis=-1, keepdims=True)
    return np.asarray(
        np.cos(angle) * flat + np.sin(angle) * np.cross(axis, flat) + (1.0 - np.cos(angle)) * along * axis
    )


def measure(frame: Frame, state: LinkageState) -> Mapping[str, SeriesValue]:
    """Return the true lengths and directions, within half a turn of the beliefs, and whether regions hold them."""
    target = frame.target
    if not isinstance(target, scene.LinkageTarget):
        return {}
    absolute = np.cumsum(target.theta)
    near = absolute + 2.0 * np.pi * np.round((state.directions - absolute) / (2.0 * np.pi))
    values: dict[str, SeriesValue] = {}
    for link in range(LINKS):
        values[f"true_length_{link + 1}"] = float(target.r[link])
        values[f"true_direction_{link + 1}"] = float(np.rad2deg(near[link]))
    if len(target.position) != IN_SPACE:
        values["mirrored"] = float(_is_mirrored(state.directions, absolute))
        values["excess"] = _excess(state, near, target)
    excluded = is_missed(state, target)
    if excluded is not None:
        values["contained"] = float(not excluded)
    return values


def is_missed(state: LinkageState, target: Target) -> bool | None:
    """Return whether regions exclude the truth; None for other beliefs, which have an estimate.

    The middle of all that is possible may be far from the truth: regions hold no point to be the likeliest.
    """
    if isinstance(state.belief, Beam) and all(isinstance(member, Region) for member in state.belief.members):
        return not contains(state, scene.in_radians(target.position))
    return None


def _is_mirrored(believed: Floats, true: Floats) -> bool:
    """Return whether a link is believed to point in its mirror image's direction, which the camera cannot distinguish.

    Args:
        believed: (3,) directions from the line of sight's plane, rad.
        true: (3,) the true ones.
    """
    off, off_mirror = np.abs(wrap(believed - true)), np.abs(wrap(believed + true))
    return bool(((off_mirror < off) & (off > CLEARLY_RAD)).any())


def _excess(state: LinkageState, directions: Floats, target: scene.LinkageTarget) -> float:
    """Return the largest error of a length or direction over its deviation; a range is two to either side."""
    lows, highs = state.low[-LINKS:], state.high[-LINKS:]
    errors = np.concatenate([np.abs(target.r - (lows + highs) / 2.0), np.abs(state.directions - directions)])
    deviations = np.concatenate([(highs - lows) / 4.0, state.directions_sd])
    known = deviations > 0.0
    return float((errors[known] / deviations[known]).max()) if known.any() else math.nan


def report(rows: Sequence[Diagnostics]) -> Mapping[str, Any]:
    """Return the lengths' final intervals, the worst direction, and how often the truth was contained, where known."""
    last = rows[-1]
    intervals = [last.vector(f"length_{link}") for link in range(1, LINKS + 1)]
    found: dict[str, Any] = {"intervals_px": [list(one) for one in intervals if one is not None]}
    errors = [row.error for row in rows if row.error is not None and math.isfinite(row.error)]
    if errors:
        found["max_angle_error_rad"] = math.radians(max(errors))
    contained = [row.number("contained") for row in rows if math.isfinite(row.number("contained"))]
    if contained:
        found["contained_share"] = sum(contained) / len(contained)
    return found


def _last_errors(course: EvaluatedRun) -> Floats:
    known = np.flatnonzero(~np.isnan(course.errors))
    errors = np.full(len(course.errors), np.nan)
    errors[known[-LAST_FRAMES:]] = course.errors[known[-LAST_FRAMES:]]
    return errors


FOLDER = Path(__file__).parent


def simulate() -> Setup:
    """Wire the simulated chain."""
    return Setup(scene.LinkageSource, SimulatedLinkageParameters(), success=HELD_AT_END.name)


def draw(step: Step, past: Sequence[Diagnostics], other: Diagnostics | None = None) -> Drawing:
    """Draw a frame: the chain in the picture, in depth, and what is known of its lengths."""
    del past
    frame, state, parameters = step.frame, step.state, step.parameters
    height, width, _ = frame.picture.shape
    longest = float(max(width, height))
    primitives: dict[str, Primitive] = {"picture": Picture(frame.picture), **draw_measurements(frame, state)}
    if isinstance(frame.target, scene.LinkageTarget):
        primitives |= truth(frame.target, state, longest)
    second = None
    if other is not None and len(other.estimate) == len(state.mean):
        second = scene.in_radians(np.array(other.estimate))
    if second is not None:
        primitives |= second_run(second, state, longest)
    primitives |= draw_belief(state, parameters.shown_hypothesis, longest)
    worlds = (
        depth_world(state, frame.target, parameters, second),
        lengths_world(state, frame.target, parameters, second),
    )
    return Drawing(width, height, primitives, _caption(step), worlds)


def _caption(step: Step) -> str:
    row, events = step.diagnostics, step.state.events
    parts = [step.tracker_title]
    count = row.number("hypothesis_count")
    if count > 1:
        parts.append(f"{count:g} hypotheses")
    parts += [word for word, times in (("split", events.splits), ("refuted", events.refuted)) if times]
    if events.outlier:
        parts.append("observation left out")
    if row.number("contained") == 0:
        parts.append("truth excluded")
    unseen = _unseen(step.frame)
    if unseen:
        parts.append(f"not seen: {', '.join(unseen)}")
    return caption(row, *parts, error_words(row, "°"))


def _unseen(frame: Frame) -> list[str]:
    """Return the names of the points that were not measured; of links seen as lines, which of these were not."""
    if frame.measurements is None:
        return list(scene.NAMES)
    if isinstance(frame.measurements, scene.LinkMeasurements):
        missing = np.flatnonzero(np.isnan(frame.measurements.offsets_px)).tolist()
        return [f"link {link + 1}" for link in missing]
    known = np.asarray(np.isfinite(frame.measurements.points_px).all(axis=1))
    return [name for name, seen in zip(scene.NAMES[-len(known) :], known.tolist(), strict=True) if not seen]


EXPERIMENT = Experiment(
    **read_words(
        FOLDER,
        TRACKERS,
        measured=Measured(measure=measure, measures=(HELD_AT_END,), report=report),
        frames={"final_direction_error_deg": _last_errors},
    ),
    id="linkage",
    warm_frames=3,
    simulate=simulate,
    video=Video(
        wire,
        footage=(*PICTURES, "tracks"),
        recorded=lambda _kind: RecordedLinkageParameters(),
        marks=(LinkagePoints,),
        wanted=WANTED,
        unmarked=("tracks",),
        advice="Start at a picture in which all four points are seen, and no link points at the camera.",
        truth=None,
        clip_title="Chain of links",
    ),
    draw=draw,
    judge=Judge(direction_error, "deg", lambda errors, _sizes, parameters: errors > parameters.lost_deg, is_missed),
)
