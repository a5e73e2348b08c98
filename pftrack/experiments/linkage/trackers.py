"""Trackers of a chain of three links before one camera, by name: lengths and pose at once, from its joints.

Depth is not seen, so image positions alone determine neither; prior knowledge of joints, motion and lengths must help.
Two families use this knowledge in two ways (Shimada 1997):

- Gaussians, which it cuts: `gaussians` steps a beam of extended Kalman filters, one for each side on which a link may
  lie (`linearised`), or one unscented filter; `particles` draws instead;
- sets, which it bounds: ellipsoids and guides that the truth never leaves, below and in `sets`.

All use one type of `state`, so a run can switch trackers, and read one set of `parameters`.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache, partial

import numpy as np

from pftrack.core.arrays import Floats
from pftrack.core.model.source import Frame, Target
from pftrack.core.model.tracker import Tracker
from pftrack.core.numerics.matrices import product
from pftrack.core.numerics.random import Stream
from pftrack.experiments.linkage import gaussians, particles
from pftrack.experiments.linkage.model import LINKS, Bounds, read_observation
from pftrack.experiments.linkage.scene import LinkageTarget
from pftrack.experiments.linkage.sets.cells import DIRECTION_CELLS, observe_in_plane
from pftrack.experiments.linkage.sets.ellipsoids import LENGTHENED, OUTER, PRINTED, SLACK
from pftrack.experiments.linkage.sets.regions import (
    CENTRE,
    HIGH,
    LOW,
    SHAPE,
    Known,
    Observe,
    Ways,
    circumscribe,
    frame_step,
    region_of,
)
from pftrack.experiments.linkage.sets.regions import contains as in_region
from pftrack.experiments.linkage.sets.space import ATTITUDE_CELLS, Link, bound_places, link_images, observe_in_space
from pftrack.experiments.linkage.state import (
    GAUSSIAN_SERIES,
    NOTHING,
    PARTICLE_SERIES,
    REGIONS,
    SERIES,
    Events,
    LinkageState,
    LinkageTrackerParameters,
    Seen,
    SeenParticles,
    measure,
)
from pftrack.filters.beam import Beam
from pftrack.filters.particles import ParticleSet, normalise

# Regions are in (S theta*_1..3, r_1..3), in space (S omega, S theta*_2, S theta*_3, r_1..3): directions rather than
# angles of joints, since a link shows nothing but its own, and px throughout, since a trace adds squares of all
# coordinates. The root in space is not among them: it is seen itself, and no link's observation depends on it.
#
# Source: Shimada 1997, section 5.5, eqs. 5.38 to 5.46; the common unit is our own (docs/methods/linkages.md).


# Trackers of a chain that believe in regions, which hold the truth as long as motion and errors keep their bounds.
#
# - `ellipsoids`: ellipsoids and guides, each bounding the other, with guides shrunk by interval arithmetic and by
#   cells;
# - `ellipsoids-literal`: as Shimada has it, where the ellipsoid alone shrinks the guides; two ways of prediction that
#   lose the truth may be chosen;
# - `box-guides`: guides alone. All that `ellipsoids` finds out about lengths it finds out too.
#
# Source: Shimada 1997, chapter 5.

ROOT = slice(3, 5)
"""Indices of the root in an estimate in space."""

TURNS = 3

SLACK_PX = 1e-6
"""Margin of the root's box, for rounding."""


@dataclass(frozen=True, slots=True, eq=False)
class Region:
    """An ellipsoid and its guides.

    Attributes:
        array: (n + 3, n), n = 6 in the plane and 8 in space, see `pftrack.experiments.linkage.sets.regions`.
        scale: S, px/rad, of the angles among its coordinates.
        has_ellipsoid: Whether there is one; if not, its centre is the middle of the guides, and its shape 0.
    """

    array: Floats
    scale: float
    has_ellipsoid: bool

    @property
    def pose(self) -> Floats:
        """(6,) centre: the directions theta*_1..3, rad, and the lengths r_1..3, px."""
        return self._six(self.array[CENTRE])

    @property
    def low(self) -> Floats:
        """(6,) low guides of the same, rad and px."""
        return self._six(self.array[LOW])

    @property
    def high(self) -> Floats:
        """(6,) high guides of the same, rad and px."""
        return self._six(self.array[HIGH])

    @property
    def shape(self) -> Floats:
        """(6, 6) shape matrix of the ellipsoid's extent in the same, rad and px; 0 without an ellipsoid."""
        whole = self.array[SHAPE:] / np.multiply.outer(self._units(), self._units())
        padded = np.zeros((2 * LINKS, 2 * LINKS))
        size = 2 * LINKS - self.in_space
        padded[-size:, -size:] = whole[-size:, -size:]
        return padded

    @property
    def in_space(self) -> bool:
        """Whether the chain is in space."""
        return bool(self.array.shape[1] != 2 * LINKS)

    def arrays(self) -> Mapping[str, Floats]:
        """Return its array, and the scale of the angles in it."""
        return {"regions": self.array, "scale": np.array(self.scale)}

    def rescale(self, scale: float) -> "Region":
        """Return the same region with another scale of its angles."""
        if scale == self.scale:
            return self
        factor = _units(self.array.shape[1], scale) / self._units()
        array = self.array * factor
        array[SHAPE:] *= factor[:, None]
        return replace(self, array=array, scale=scale)

    def _units(self) -> Floats:
        return _units(self.array.shape[1], self.scale)

    def _six(self, row: Floats) -> Floats:
        told = row / self._units()
        return np.concatenate([[0.0], told[TURNS:]]) if self.in_space else told


def begin(
    box: tuple[Floats, Floats],
    scale: float,
    *,
    directions: tuple[Floats, Floats] | None = None,
    inscribed: bool = False,
) -> Region:
    """Return the region of a box of estimates.

    Args:
        box: Its least and greatest estimate, (6,) in the plane or (11,) in space.
        scale: S, px/rad.
        directions: (3,) least and greatest directions, rad, where tighter than the box.
        inscribed: Whether the ellipsoid lies in the box, as Shimada may be read; it does not hold all.
    """
    low, high = (_coordinates(end) for end in box)
    turn = _cumulative(len(low))
    units = _units(len(low), scale)
    half = 0.5 * (high - low) * units + SLACK
    shape = np.diag(half * half if inscribed else half * half.sum())
    shape = product(product(turn, shape), turn.T)
    # All entries of the sum are 0 or 1, so the least sum is the sum of the least values.
    low, high = product(turn, low), product(turn, high)
    if directions is not None:
        here = slice(TURNS, TURNS + LINKS - 1) if len(low) > 2 * LINKS else slice(0, LINKS)
        least, most = (end[-(here.stop - here.start) :] for end in directions)
        low[here] = np.clip(least, low[here], high[here])
        high[here] = np.clip(most, low[here], high[here])
        return Region(region_of(low * units, high * units), scale, has_ellipsoid=True)
    return Region(region_of(low * units, high * units, shape), scale, has_ellipsoid=True)


def union(regions: Sequence[Region]) -> tuple[Floats, Floats]:
    """Return the least and greatest (6,) directions, rad, and lengths, px, of some regions."""
    return np.min([region.low for region in regions], axis=0), np.max([region.high for region in regions], axis=0)


def box_of(regions: Sequence[Region], bounds: Bounds, root: tuple[Floats, Floats] | None) -> tuple[Floats, Floats]:
    """Return the least and the greatest estimate, (6,) or (11,), that some regions hold.

    Args:
        regions: At least one.
        bounds: Bounds of joints, which the differences of directions may exceed.
        root: (2,) least and greatest place of the root, in space.
    """
    low, high = union(regions)
    least, most = low.copy(), high.copy()
    least[1:LINKS] -= high[: LINKS - 1]
    most[1:LINKS] -= low[: LINKS - 1]
    first = 0 if root is None else 1
    within = slice(first, LINKS)
    least[within] = np.minimum(np.maximum(least, (*bounds.joint_low, 0, 0, 0))[within], most[within])
    most[within] = np.maximum(np.minimum(most, (*bounds.joint_high, 0, 0, 0))[within], least[within])
    if root is None:
        return least, most
    units = regions[0].scale
    turns_low = np.min([region.array[LOW, :TURNS] for region in regions], axis=0) / units
    turns_high = np.max([region.array[HIGH, :TURNS] for region in regions], axis=0) / units
    return np.concatenate([turns_low, root[0], least]), np.concatenate([turns_high, root[1], most])


def contains(state: LinkageState, position: Floats) -> bool:
    """Return whether a state's regions hold (theta, r) or (omega, t, theta, r), (6,) or (11,), rad and px.

    One of them must hold the angles and lengths, and the root's box the root.
    """
    if isinstance(state.belief, ParticleSet):
        return False
    off = np.maximum(state.low - position, position - state.high)
    if state.in_space and np.any(off[ROOT] > SLACK_PX):
        return False
    point = _coordinates(position)
    point = product(_cumulative(len(point)), point)
    return any(
        isinstance(member, Region)
        and in_region(member.array, point * _units(len(point), member.scale), ellipsoids=member.has_ellipsoid)
        for member in state.belief.members
    )


@lru_cache(maxsize=64)
def known_bounds(bounds: Bounds, scale: float, motion_rad: float, *, in_space: bool) -> Known:
    """Return the bounds of joints and lengths as inequalities of a region's coordinates, and their largest motion."""
    size = 2 * LINKS + 2 if in_space else 2 * LINKS
    constraints = bounds.constraints(in_space=in_space)
    joints = np.zeros((len(constraints.rows), size))
    joints[:, -2 * LINKS + in_space :] = constraints.rows[:, int(in_space) :]
    # theta = D theta*: a row of joint angles, a_k theta_k, is (a_k - a_{k+1}) theta*_k.
    first = TURNS if in_space else 0
    rows = joints.copy()
    rows[:, first : size - LINKS - 1] -= joints[:, first + 1 : size - LINKS]
    angles = size - LINKS
    return Known(rows / _units(size, scale), constraints.low, constraints.high, angles, scale * motion_rad)


def _coordinates(position: Floats) -> Floats:
    """Return (theta, r) of an estimate in the plane, (omega, theta_2, theta_3, r) of one in space."""
    return position if len(position) == 2 * LINKS else np.concatenate([position[:TURNS], position[TURNS + 3 :]])


def _cumulative(size: int) -> Floats:
    """Return the matrix (n, n) that adds up the angles of joints, and leaves the rest."""
    turn = np.eye(size)
    first = TURNS if size > 2 * LINKS else 0
    for row in range(first, size - LINKS):
        turn[row, first : row + 1] = 1.0
    return turn


def _units(size: int, scale: float) -> Floats:
    """Return by what coordinates in rad and px are multiplied, (n,)."""
    return np.array([scale] * (size - LINKS) + [1.0] * LINKS)


WAYS_OF_PREDICTION: Mapping[str, int] = {"outer": OUTER, "lengthened": LENGTHENED, "printed": PRINTED}

FROM_SDS = 3.0
"""Half the width, in standard deviations, of the box that is taken over from another kind of belief."""

Box = tuple[Floats, Floats]


def start(method: str, target: Target, frame: Frame, parameters: LinkageTrackerParameters, rng: Stream) -> LinkageState:
    """Begin with the box of all that is possible at first; the first observation is that of the next frame."""
    del frame, rng
    chain = LinkageTarget.of(target)
    angle, length = np.full(3, parameters.start_angle_bound_rad), np.full(3, parameters.start_length_bound_px)
    half, root = np.concatenate([angle, length]), None
    if chain.t is not None:
        around = np.full(2, parameters.start_root_bound_px)
        half, root = np.concatenate([angle, around, half]), (chain.t - around, chain.t + around)
    box = _cut((chain.numbers - half, chain.numbers + half), parameters.bounds)
    inscribed = method == "ellipsoids-literal" and parameters.first_ellipsoid == "inscribed"
    region = begin(box, float(parameters.angle_scale_px), inscribed=inscribed)
    beam = Beam.of(_set_ellipsoid(region, ellipsoids=method != "box-guides"))
    return _state(beam, parameters.bounds, root, chain.origin_px, chain.reference)


def step(
    method: str, state: LinkageState, frame: Frame, parameters: LinkageTrackerParameters, rng: Stream
) -> LinkageState:
    """Take one frame.

    Args:
        method: Name of the tracker.
        state: State of the frame before, from any tracker.
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
    regions, parents, events = frame_step(
        [region.array for region in before],
        observe,
        known,
        known_bounds(parameters.bounds, scale, float(parameters.motion_bound_rad), in_space=state.in_space),
        treated,
    )
    members = tuple(_set_ellipsoid(Region(one, scale, True), ellipsoids=treated.ellipsoids) for one in regions)
    if not own:
        parents = np.full(len(members), -1)
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
        events,
    )


@lru_cache(maxsize=64)
def ways(method: str, parameters: LinkageTrackerParameters) -> Ways:
    """Return how a tracker treats its regions."""
    literal = method == "ellipsoids-literal"
    return Ways(
        ellipsoids=method != "box-guides",
        guided=not literal,
        splitting=parameters.split_regions,
        way=WAYS_OF_PREDICTION[parameters.predicted_ellipsoid] if literal else OUTER,
    )


def _observing(
    seen: Floats,
    reference: Floats | None,
    parameters: LinkageTrackerParameters,
    treated: Ways,
) -> tuple[list[int], Observe]:
    """Return the links with an observation, and the observer that takes that into account."""
    scale, once = float(parameters.angle_scale_px), float(parameters.error_bound_px)
    if reference is None:
        shown = np.diff(seen[:, 0], prepend=0.0)

        def in_plane(region: Floats, link: int, most: int) -> Floats:
            # The root is known exactly.
            bound, length = once if link == 0 else 2.0 * once, float(shown[link])
            return observe_in_plane(region, (link, LINKS + link), scale, length, bound, DIRECTION_CELLS, most, treated)

        return np.flatnonzero(~np.isnan(shown)).tolist(), in_plane
    images = link_images(seen, once)
    places = [
        Link(LINKS - 1 + link if link > 0 else -1, 2 + LINKS + link, scale, product(image.turn, reference))
        if image is not None
        else None
        for link, image in enumerate(images)
    ]

    def in_space(region: Floats, link: int, most: int) -> Floats:
        place, image = places[link], images[link]
        if place is None or image is None:
            raise RuntimeError("a link without a measurement is not observed")
        return observe_in_space(region, place, image.middle, image.bound, ATTITUDE_CELLS, most, treated)

    return [link for link, image in enumerate(images) if image is not None], in_space


def _root(seen: Floats, longest: Floats, parameters: LinkageTrackerParameters, last: Box) -> Box:
    """Return the least and the greatest place (2,) of the root: seen itself, or as far from a joint as links reach.

    Without an observation it stays around its last place.
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
    """Return a region with or without an ellipsoid."""
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

    A range wholly outside is moved to the bound with its width, so a contradiction does not create certainty.
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
    origin_px: Floats,
    reference: Floats | None,
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


def _filter(name: str) -> Tracker:
    stepped = gaussians.unscented_step if name == "ukf" else partial(gaussians.filter_step, name)
    return Tracker(name, gaussians.start, stepped, series=GAUSSIAN_SERIES, measure=measure, model=Seen())


def _sets(name: str) -> Tracker:
    started, stepped = partial(start, name), partial(step, name)
    return Tracker(name, started, stepped, series=SERIES, measure=measure, model=Seen())


PARTICLES = Tracker(
    "particles", gaussians.start, particles.step, series=PARTICLE_SERIES, measure=measure, model=SeenParticles()
)

TRACKERS = {
    **{name: _filter(name) for name in ("ekf-mirrors", "ekf-truncated", "ekf", "ukf")},
    PARTICLES.id: PARTICLES,
    **{name: _sets(name) for name in REGIONS},
}
"""All trackers by name, in the order in which they are shown."""
