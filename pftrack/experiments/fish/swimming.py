"""How the simulated goldfish swim: they head for waypoints, avoid each other and the walls, and turn by bending.

A fish beats its tail, and bends away from the side to which it turns: the head recoils from the tail's stroke (the
coupling of yaw and bend that Mitsugami et al. 2009 learn). Sometimes it makes a C-turn: a strong bend within a few
steps, which swings it round, and a return stroke that drives it off. A second has thirty steps, and every second step
is a frame.

A clip is redrawn until it suits the experiment: no fish near the border or another fish, and sharp turns of exactly the
lively fish. That takes from ten to some thousand draws, so clips are cached.
"""

from functools import lru_cache
from typing import Literal, NamedTuple, TypeAlias

import numpy as np

from pftrack.core.arrays import Floats, Ints
from pftrack.core.numerics.compiled import compiled, read_only
from pftrack.core.numerics.random import standard_normals, uniforms

WIDTH, HEIGHT = 640, 480
FRAME_RATE_HZ, FRAMES, STEPS_A_FRAME = 15.0, 150, 2
STEPS, STEP_RATE_HZ = FRAMES * STEPS_A_FRAME, FRAME_RATE_HZ * STEPS_A_FRAME

MARGIN_PX, APART_PX = 50.0, 110.0
"""Least distance of every fish from the border, and from the other."""

MOST_DRAWS = 200_000
"""Largest number of draws of a clip; the slowest tank takes some thousand."""

SHARP_COSINE, SHARP_FRAMES, SHARP_SPEED_PX = 0.5, 4, 3.0
"""A sharp turn: the way changes by 60 degrees within four frames, at more than this speed before and after."""

FIRST_REST, AFTER_BEND, FIRST_SPEED = 20, 20, 4.0
"""Steps before the first C-turn, steps of a C-turn after its bend, and first speed, px/step."""

MOST_BENT, SHY_PX = 1.35, 230.0
"""Largest bend, rad; distance at which fish begin to avoid each other."""

NORMALS, UNIFORMS, BEGINNING, BLOCK = 5, 4, 8, 30
"""Random numbers of a fish per step, random numbers for its start, and steps whose numbers are drawn at once."""

SCENE = 2
"""Purpose.SCENE, as compiled code needs it."""

TankName: TypeAlias = Literal["goldfish", "strong rudder"]
Clip: TypeAlias = Floats
"""(FRAMES, fish, 4) poses (a, b, theta, phi) in px and rad; theta is not wrapped."""


class Tank(NamedTuple):
    """Reaction of the water to a fish: the constants of docs/methods/diffusion.md.

    Attributes:
        recoil: K1, rad of yaw against each rad of bend.
        drag: K2, the same with the square of the bend's rate.
        rudder: KR, rad of yaw for each px of speed and rad of bend.
        thrust: KT, px/frame for each rad of bend.
        friction: KD, share of the speed that a step takes.
        slip: KL, share of the sideways speed that a step leaves.
        side: KS, px of sideways speed for each rad of bend.
        bend_steps: NB, steps of the bend of a C-turn.
        straighten: Share of that bend that remains after each later step.
    """

    recoil: float
    drag: float
    rudder: float
    thrust: float
    friction: float
    slip: float
    side: float
    bend_steps: int
    straighten: float


TANKS: dict[TankName, Tank] = {
    "goldfish": Tank(0.70, 1.2, 0.016, 5.5, 0.10, 0.35, 1.5, 7, 0.88),
    "strong rudder": Tank(0.60, 0.0, 0.028, 6.0, 0.10, 0.35, 4.0, 3, 0.72),
}
"""The tank of the experiments, and a counterexample: the return stroke turns the same way as the bend."""


@lru_cache(maxsize=32)
def clip(number: int, count: int, lively: bool, tank: TankName) -> Clip:
    """Return the poses of all fish in all frames, read-only.

    Args:
        number: Number of the clip, the seed of everything drawn.
        count: Number of fish.
        lively: Whether the first fish turns sharply; others never do.
        tank: Reaction of the water.

    Raises:
        ValueError: No fit clip was drawn; it has never been seen to happen.
    """
    for draw in range(MOST_DRAWS):
        poses = _swim(TANKS[tank], count, lively, number, draw)
        if len(poses) and all(has_sharp_turn(poses[:, fish, :2]) == (lively and fish == 0) for fish in range(count)):
            return read_only(poses)
    raise ValueError(f"clip {number} has not come out in {MOST_DRAWS} draws")


@compiled
def has_sharp_turn(path: Floats) -> bool:
    """Return whether the way of motion along a path (n, 2), px a frame, changes by 60 degrees within four frames."""
    count = path.shape[0]
    for first in range(1, count):
        u, v = path[first, 0] - path[first - 1, 0], path[first, 1] - path[first - 1, 1]
        speed = np.sqrt(u * u + v * v)
        for later in range(first + 1, min(first + SHARP_FRAMES, count - 1) + 1):
            x, y = path[later, 0] - path[later - 1, 0], path[later, 1] - path[later - 1, 1]
            other = np.sqrt(x * x + y * y)
            if min(speed, other) > SHARP_SPEED_PX and u * x + v * y <= SHARP_COSINE * speed * other:
                return True
    return False


class Shoal(NamedTuple):
    """The state of n fish.

    Attributes:
        places: (n, 2) px.
        speeds: (n, 2) px/step.
        goals: (n, 2) where each swims to, px.
        theta: (n,) rad.
        phi: (n,) rad.
        phase: (n,) of the beat of the tail, rad.
        amplitude: (n,) of the beat, rad.
        beat: (n,) advance of the phase, rad/step.
        bias: (n,) bend for steering, rad.
        bend: (n,) bend of a C-turn, rad.
        stroke: (n,) bend that a C-turn adds in each step, rad.
        turn: (n,) step of a C-turn, from 1; 0 outside of one.
        rest: (n,) steps during which no C-turn begins.
        age: (n,) steps since it got its goal.
    """

    places: Floats
    speeds: Floats
    goals: Floats
    theta: Floats
    phi: Floats
    phase: Floats
    amplitude: Floats
    beat: Floats
    bias: Floats
    bend: Floats
    stroke: Floats
    turn: Ints
    rest: Ints
    age: Ints


@compiled
def _swim(tank: Tank, count: int, lively: bool, number: int, draw: int) -> Floats:
    """Return the poses (FRAMES, count, 4) of one draw of a clip, or an empty array if the fish come too near."""
    shoal = _begin(count, uniforms(number, 0, SCENE, draw, count * BEGINNING).reshape(count, BEGINNING))
    poses = np.empty((FRAMES, count, 4))
    for step in range(STEPS):
        if step % BLOCK == 0:  # most draws fail early, and take no more random numbers than they need
            block = draw * (STEPS // BLOCK) + step // BLOCK
            normals = standard_normals(number, 1, SCENE, block, BLOCK * count * NORMALS)
            shares = uniforms(number, 2, SCENE, block, BLOCK * count * UNIFORMS)
        if _too_near(shoal.places):
            return poses[:0]
        if step % STEPS_A_FRAME == 0:
            for fish in range(count):
                pose = poses[step // STEPS_A_FRAME, fish]
                pose[0], pose[1] = shoal.places[fish, 0], shoal.places[fish, 1]
                pose[2], pose[3] = shoal.theta[fish], shoal.phi[fish]
        before = shoal.places.copy()
        for fish in range(count):
            first = (step % BLOCK) * count + fish
            noise = normals[first * NORMALS : (first + 1) * NORMALS]
            share = shares[first * UNIFORMS : (first + 1) * UNIFORMS]
            error = _aim(shoal, before, fish, share)
            change = _bend(tank, shoal, fish, error, lively and fish == 0, noise, share)
            _move(tank, shoal, fish, change, noise)
    return poses


@compiled
def _begin(count: int, share: Floats) -> Shoal:
    """Return fish at random, given uniform numbers (n, 8)."""
    shoal = Shoal(
        np.empty((count, 2)),
        np.empty((count, 2)),
        np.empty((count, 2)),
        2.0 * np.pi * share[:, 0],
        np.zeros(count),
        2.0 * np.pi * share[:, 1],
        0.15 + 0.15 * share[:, 2],
        2.0 * np.pi * (1.5 + share[:, 3]) / STEP_RATE_HZ,
        np.zeros(count),
        np.zeros(count),
        np.zeros(count),
        np.zeros(count, np.int64),
        np.full(count, FIRST_REST),
        np.zeros(count, np.int64),
    )
    for fish in range(count):
        shoal.places[fish, 0], shoal.places[fish, 1] = 120.0 + 400.0 * share[fish, 4], 100.0 + 280.0 * share[fish, 5]
        shoal.goals[fish, 0], shoal.goals[fish, 1] = 180.0 + 280.0 * share[fish, 6], 150.0 + 180.0 * share[fish, 7]
        shoal.speeds[fish, 0] = FIRST_SPEED * np.cos(shoal.theta[fish])
        shoal.speeds[fish, 1] = FIRST_SPEED * np.sin(shoal.theta[fish])
    return shoal


@compiled
def _aim(shoal: Shoal, before: Floats, fish: int, share: Floats) -> float:
    """Return the angle to a fish's goal, and give it another goal once it is there or has tried for too long."""
    goal = shoal.goals[fish]
    away = (goal[0] - before[fish, 0]) ** 2 + (goal[1] - before[fish, 1]) ** 2
    shoal.age[fish] += 1
    if away < 70.0**2 or shoal.age[fish] > 90:
        goal[0], goal[1], shoal.age[fish] = 180.0 + 280.0 * share[0], 150.0 + 180.0 * share[1], 0
    return _error(before, fish, goal, shoal.theta[fish])


@compiled
def _bend(
    tank: Tank,
    shoal: Shoal,
    fish: int,
    error: float,
    quick: bool,
    noise: Floats,
    share: Floats,
) -> float:
    """Bend a fish, and return the change of the bend, rad."""
    shoal.phase[fish] += shoal.beat[fish]
    shoal.bias[fish] += 0.15 * (min(max(-0.7 * error, -0.45), 0.45) - shoal.bias[fish]) + 0.02 * noise[0]
    if shoal.turn[fish] == 0:
        shoal.rest[fish] -= 1
        if shoal.rest[fish] < 0 and abs(error) > (0.8 if quick else 0.35) and share[2] < 0.15:
            strength = 1.0 + 0.25 * share[3] if quick else 0.25 + 0.15 * share[3]
            shoal.stroke[fish] = (-strength if error > 0.0 else strength) / tank.bend_steps
            shoal.turn[fish] = 1
    elif shoal.turn[fish] == tank.bend_steps + AFTER_BEND:
        shoal.turn[fish], shoal.rest[fish] = 0, 20 if quick else 6
    else:
        shoal.turn[fish] += 1
    if 1 <= shoal.turn[fish] <= tank.bend_steps:
        shoal.bend[fish] += shoal.stroke[fish]
    else:
        shoal.bend[fish] *= tank.straighten
    wave = shoal.amplitude[fish] * np.sin(shoal.phase[fish])
    wanted = wave + shoal.bias[fish] + shoal.bend[fish] + 0.01 * noise[1]
    before, shoal.phi[fish] = shoal.phi[fish], min(max(wanted, -MOST_BENT), MOST_BENT)
    return float(shoal.phi[fish] - before)


@compiled
def _move(tank: Tank, shoal: Shoal, fish: int, change: float, noise: Floats) -> None:
    """Turn and move a fish by the water's reaction to a change of its bend, rad."""
    u, v = shoal.speeds[fish, 0], shoal.speeds[fish, 1]
    rudder = tank.rudder * min(np.sqrt(u * u + v * v), 10.0) * shoal.phi[fish]
    shoal.theta[fish] += -tank.recoil * change - tank.drag * change * abs(change) - rudder + 0.008 * noise[2]
    cosine, sine = np.cos(shoal.theta[fish]), np.sin(shoal.theta[fish])
    ahead, aside = cosine * u + sine * v, cosine * v - sine * u
    push = 1.0 if shoal.turn[fish] > tank.bend_steps + 1 else 0.6
    gained = 0.3 * abs(aside) + tank.thrust * abs(change) * push - tank.friction * ahead
    ahead = max(ahead + gained + 0.10 * noise[3], 0.5)
    aside = tank.slip * aside + tank.side * change + 0.10 * noise[4]
    shoal.speeds[fish, 0], shoal.speeds[fish, 1] = cosine * ahead - sine * aside, sine * ahead + cosine * aside
    shoal.places[fish, 0] += shoal.speeds[fish, 0]
    shoal.places[fish, 1] += shoal.speeds[fish, 1]


@compiled
def _too_near(places: Floats) -> bool:
    """Return whether a fish is too near to the border, or to another."""
    for fish in range(places.shape[0]):
        x, y = places[fish, 0], places[fish, 1]
        if not (MARGIN_PX <= x < WIDTH - MARGIN_PX and MARGIN_PX <= y < HEIGHT - MARGIN_PX):
            return True
        for other in range(fish):
            if (x - places[other, 0]) ** 2 + (y - places[other, 1]) ** 2 <= APART_PX**2:
                return True
    return False


@compiled
def _error(places: Floats, fish: int, goal: Floats, theta: float) -> float:
    """Return the angle from a fish's heading to where it would like to go, rad, wrapped to half a turn."""
    x, y = places[fish, 0], places[fish, 1]
    u, v = goal[0] - x, goal[1] - y
    length = max(np.sqrt(u * u + v * v), 1e-9)
    u, v = u / length, v / length
    for other in range(places.shape[0]):
        if other != fish:
            right, down = x - places[other, 0], y - places[other, 1]
            distance = max(np.sqrt(right * right + down * down), 1e-9)
            if distance < SHY_PX:
                strength = 0.8 * (SHY_PX / distance) ** 2 / distance
                u, v = u + strength * right, v + strength * down
    u += (max(0.0, 150.0 - x) - max(0.0, x - 490.0)) / 25.0
    v += (max(0.0, 150.0 - y) - max(0.0, y - 330.0)) / 25.0
    cosine, sine = np.cos(theta), np.sin(theta)
    return float(np.arctan2(cosine * v - sine * u, cosine * u + sine * v))
