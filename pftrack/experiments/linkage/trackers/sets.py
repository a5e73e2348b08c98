"""Trackers of a chain that believe in regions, which hold the truth as long as motion and errors keep their bounds.

- `ellipsoids`: ellipsoids and guides, each bounding the other, with guides shrunk by interval arithmetic and by cells;
- `ellipsoids-literal`: as Shimada has it, where the ellipsoid alone shrinks the guides; two ways of
  prediction that lose the truth may be chosen;
- `box-guides`: guides alone. All that `ellipsoids` finds out about lengths it finds out too.

Source: Shimada 1997, chapter 5.
"""

from collections.abc import Mapping
from functools import lru_cache, partial

import numpy as np
from numpy.typing import NDArray

from pftrack.core.model.frame import Frame, Target
from pftrack.core.model.tracker import Tracker
from pftrack.core.numerics.matrices import product
from pftrack.core.numerics.random import Stream
from pftrack.experiments.linkage.scene.truth import LinkageTarget
from pftrack.experiments.linkage.sets.frame import Observe, frame_step
from pftrack.experiments.linkage.sets.guides import circumscribe
from pftrack.experiments.linkage.sets.observation import observe_in_plane
from pftrack.experiments.linkage.sets.prediction import LENGTHENED, OUTER, PRINTED
from pftrack.experiments.linkage.sets.regions import CENTRE, HIGH, LOW, SHAPE, Ways
from pftrack.experiments.linkage.sets.space_cells import Link
from pftrack.experiments.linkage.sets.space_observation import observe_in_space
from pftrack.experiments.linkage.sets.strips import TRACE, VOLUME
from pftrack.experiments.linkage.shape import LINKS, Bounds
from pftrack.experiments.linkage.trackers.inspection import hypotheses_of, range_parts
from pftrack.experiments.linkage.trackers.observation import read_observation
from pftrack.experiments.linkage.trackers.parameters import LinkageTrackerParameters
from pftrack.experiments.linkage.trackers.places import bound_places, link_images
from pftrack.experiments.linkage.trackers.regions import ROOT, Region, begin, box_of, known_bounds, union
from pftrack.experiments.linkage.trackers.reports import SERIES, measure
from pftrack.experiments.linkage.trackers.state import NOTHING, Events, LinkageState
from pftrack.filters.beam import Beam
from pftrack.filters.particles import ParticleSet, normalise

__all__ = ["TRACKERS"]

WAYS_OF_PREDICTION: Mapping[str, int] = {"outer": OUTER, "lengthened": LENGTHENED, "printed": PRINTED}

FROM_SDS = 3.0
"""Half the width, in standard deviations, of the box that is taken over from another kind of belief."""

Box = tuple[NDArray[np.float64], NDArray[np.float64]]


def start(method: str, target: Target, frame: Frame, parameters: LinkageTrackerParameters, rng: Stream) -> LinkageState:
    """Begin with the box of all that is possible at first; the first observation is that of the next frame."""
    del frame, rng
    if not isinstance(target, LinkageTarget):
        raise TypeError(f"a tracker of a chain begins at the pose of one, got {type(target).__name__}")
    angle, length = np.full(3, parameters.start_angle_bound_rad), np.full(3, parameters.start_length_bound_px)
    middle, half, root = np.concatenate([target.theta, target.r]), np.concatenate([angle, length]), None
    if target.omega is not None and target.t is not None:
        around = np.full(2, parameters.start_root_bound_px)
        middle = np.concatenate([target.omega, target.t, middle])
        half = np.concatenate([angle, around, half])
        root = target.t - around, target.t + around
    box = _cut((middle - half, middle + half), parameters.bounds)
    inscribed = method == "ellipsoids-literal" and parameters.first_ellipsoid == "inscribed"
    region = begin(box, float(parameters.angle_scale_px), inscribed=inscribed)
    beam = Beam.of(_set_ellipsoid(region, ellipsoids=method != "box-guides"))
    return _state(beam, parameters.bounds, root, target.origin_px, target.reference)


def step(
    method: str, state: LinkageState, frame: Frame, parameters: LinkageTrackerParameters, rng: Stream
) -> LinkageState:
    """Take one frame.

    Args:
        method: Name of the tracker.
        state: Of the frame before, of any tracker.
        frame: What was seen.
        parameters: In force.
        rng: Not used.
    """
    del rng
    treated = ways(method, parameters)
    scale = float(parameters.angle_scale_px)
    before, own = _regions(state, parameters, ellipsoids=treated.ellipsoids)
    seen = read_observation(frame, state.origin_px, in_space=state.in_space)
    known, observe = _observing(seen, state.reference, parameters, treated)
    found = frame_step(
        [region.array for region in before],
        observe,
        known,
        known_bounds(parameters.bounds, scale, float(parameters.motion_bound_rad), in_space=state.in_space),
        parameters.region_passes,
        treated,
    )
    members = tuple(_set_ellipsoid(Region(one, scale, True), ellipsoids=treated.ellipsoids) for one in found.regions)
    parents = found.parents if own else np.full(len(members), -1)
    root = None
    if state.in_space:
        last = state.low[ROOT], state.high[ROOT]
        root = _root(seen, union(members)[1][LINKS:], parameters, last)
    return _state(
        Beam(members, normalise(np.zeros(len(members)))[0], parents),
        parameters.bounds,
        root,
        state.origin_px,
        state.reference,
        Events(found.splits, found.merges, found.refuted, 0, found.outlier),
    )


@lru_cache(maxsize=64)
def ways(method: str, parameters: LinkageTrackerParameters) -> Ways:
    """Return how a tracker treats its regions."""
    literal = method == "ellipsoids-literal"
    return Ways(
        ellipsoids=method != "box-guides",
        least=TRACE if parameters.least_ellipsoid == "trace" else VOLUME,
        tighten=parameters.tightened,
        contraction=not literal,
        sampled=not literal,
        sides=method == "ellipsoids",
        splitting=parameters.split_regions,
        way=WAYS_OF_PREDICTION[parameters.predicted_ellipsoid] if literal else OUTER,
    )


def _observing(
    seen: NDArray[np.float64],
    reference: NDArray[np.float64] | None,
    parameters: LinkageTrackerParameters,
    treated: Ways,
) -> tuple[list[int], Observe]:
    """Return of which links something was seen, and what takes that into account."""
    scale, once = float(parameters.angle_scale_px), float(parameters.error_bound_px)
    if reference is None:
        shown = np.diff(seen[:, 0], prepend=0.0)

        def in_plane(region: NDArray[np.float64], link: int, most: int) -> NDArray[np.float64]:
            # The root is known exactly.
            bound, length = once if link == 0 else 2.0 * once, float(shown[link])
            return observe_in_plane(
                region, (link, LINKS + link), scale, length, bound, parameters.direction_cells, most, treated
            )

        return np.flatnonzero(~np.isnan(shown)).tolist(), in_plane
    images = link_images(seen, once)
    places = [
        Link(LINKS - 1 + link if link > 0 else -1, 2 + LINKS + link, scale, product(image.turn, reference))
        if image is not None
        else None
        for link, image in enumerate(images)
    ]

    def in_space(region: NDArray[np.float64], link: int, most: int) -> NDArray[np.float64]:
        place, image = places[link], images[link]
        if place is None or image is None:
            raise RuntimeError("a link of which nothing was seen is not observed")
        cells = parameters.attitude_cells
        return observe_in_space(region, place, image.middle, image.bound, cells, most, treated)

    return [link for link, image in enumerate(images) if image is not None], in_space


def _root(
    seen: NDArray[np.float64], longest: NDArray[np.float64], parameters: LinkageTrackerParameters, last: Box
) -> Box:
    """Return the least and the greatest place (2,) of the root: seen itself, or as far from a joint as links reach.

    Where nothing is seen it is around where it was.
    """
    reach = bound = float(parameters.error_bound_px)
    for point, half, length in zip(*bound_places(seen, bound), (*longest, 0.0), strict=True):
        if np.isfinite(half).all():
            return point - (reach + (half - bound)), point + (reach + (half - bound))
        reach += float(length)
    moved = float(parameters.root_motion_bound_px)
    return last[0] - moved, last[1] + moved


def _regions(
    state: LinkageState, parameters: LinkageTrackerParameters, *, ellipsoids: bool
) -> tuple[tuple[Region, ...], bool]:
    """Return the regions of a state, in the scale in force, and whether they are its own rather than made of it."""
    scale = float(parameters.angle_scale_px)
    members = () if isinstance(state.belief, ParticleSet) else state.belief.members
    own = tuple(member for member in members if isinstance(member, Region))
    if members and len(own) == len(members):
        return tuple(_set_ellipsoid(region.rescale(scale), ellipsoids=ellipsoids) for region in own), True
    around = FROM_SDS * state.spread
    box = _cut((state.mean - around, state.mean + around), parameters.bounds)
    off = FROM_SDS * state.directions_sd
    region = begin(box, scale, directions=(state.directions - off, state.directions + off))
    return (_set_ellipsoid(region, ellipsoids=ellipsoids),), False


def _set_ellipsoid(region: Region, *, ellipsoids: bool) -> Region:
    """Return a region that has an ellipsoid, or has none."""
    if ellipsoids and region.has_ellipsoid:
        return region
    array = region.array.copy()
    if ellipsoids:
        circumscribe(array[LOW], array[HIGH], array[CENTRE], array[SHAPE:])
    else:
        array[CENTRE] = 0.5 * (array[LOW] + array[HIGH])
        array[SHAPE:] = 0.0
    return Region(array, region.scale, ellipsoids)


def _cut(box: Box, bounds: Bounds) -> Box:
    """Return a box of estimates cut by the bounds of joints and lengths.

    What is wholly outside is moved to the bound, with its width: nothing becomes certain by a contradiction.
    """
    least = np.array([*bounds.joint_low, *bounds.length_low])
    most = np.array([*bounds.joint_high, *bounds.length_high])
    low, high = box[0].copy(), box[1].copy()
    bottom, top = low[-2 * LINKS :], high[-2 * LINKS :]
    moved = np.where(top < least, least - bottom, np.where(bottom > most, most - top, 0.0))
    for end in (bottom, top):
        end[:] = np.clip(end + moved, least, most)
    return low, high


def _state(
    beam: Beam[Region],
    bounds: Bounds,
    root: Box | None,
    origin_px: NDArray[np.float64],
    reference: NDArray[np.float64] | None,
    events: Events = NOTHING,
) -> LinkageState:
    """Return the state of some regions: the estimate is the middle of the box around them, as if it were uniform."""
    low, high = box_of(beam.members, bounds, root)
    least, most = (end[:LINKS] for end in union(beam.members))
    deviation = np.sqrt(1.0 / 12.0)
    return LinkageState(
        beam,
        0.5 * (low + high),
        deviation * (high - low),
        low,
        high,
        0.5 * (least + most),
        deviation * (most - least),
        origin_px,
        reference,
        0.0,
        events,
    )


def _tracker(name: str, title: str, description: str) -> Tracker:
    return Tracker(
        name,
        title,
        description,
        partial(start, name),
        partial(step, name),
        series=SERIES,
        measure=measure,
        cloud=hypotheses_of,
        update_parts=range_parts,
    )


TRACKERS = {
    tracker.id: tracker
    for tracker in (
        _tracker(
            "ellipsoids",
            "Guided ellipsoids",
            "Keeps every pose and length that is possible, in ellipsoids and boxes that bound each other.",
        ),
        _tracker(
            "ellipsoids-literal",
            "Ellipsoids as in the source",
            "Keeps what is possible in ellipsoids, whose extent alone bounds the lengths.",
        ),
        _tracker(
            "box-guides",
            "Guides alone",
            "Keeps what is possible in boxes, shrunk by interval arithmetic, without any ellipsoid.",
        ),
    )
}
"""Trackers that believe in regions, by name."""
