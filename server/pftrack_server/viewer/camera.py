"""The camera of each browser: presets fitted to the window, kept until a person moves the camera.

viser's cameras use perspective. A field of view of a few degrees from far away is practically orthographic, so the
front preset shows the picture undistorted. A browser begins with the oblique preset, which shows depth and height.
Presets are fitted: the camera moves back along its direction until every corner of the box lies within the window.
"""

import itertools
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from typing import TypeAlias

import numpy as np
import viser
from numpy.typing import NDArray

RELIEF_STEPS = 8
FULL_RELIEF_RAD = np.deg2rad(18.0)
FLAT_RAD = np.deg2rad(1.5)


@dataclass(frozen=True, slots=True)
class Preset:
    """A camera preset.

    Attributes:
        title: Title of its button.
        direction: Direction from the target point to the camera.
        fov_rad: Vertical field of view.
        deep: Whether to fit heights above the picture, too.
        whole: Whether to fit the camera that took the picture, too.
    """

    title: str
    direction: tuple[float, float, float]
    fov_rad: float
    deep: bool = False
    whole: bool = False


PRESETS: dict[str, Preset] = {
    "oblique": Preset("Oblique", (-0.62, 0.42, 0.66), float(np.deg2rad(30.0)), deep=True, whole=True),
    "front": Preset("Front", (0.0, 0.0, 1.0), float(np.deg2rad(6.0))),
    "side": Preset("Side", (-0.85, 0.30, 0.43), float(np.deg2rad(20.0)), deep=True, whole=True),
    "time": Preset("Along time", (0.0, 0.95, 0.32), float(np.deg2rad(20.0)), deep=True),
}
FIRST = "oblique"
"""The preset of a new browser."""


@dataclass(frozen=True, slots=True)
class Box:
    """Extent of the scene, px.

    Attributes:
        width: Width of the picture.
        height: Height of the picture.
        depth: Largest height above it.
        apex: (x, y, z) in the scene of the camera that took the picture, if that is shown.
        behind: Largest distance behind it.
        beside: Extent of objects to its right.
    """

    width: float
    height: float
    depth: float = 0.0
    apex: tuple[float, float, float] | None = None
    behind: float = 0.0
    beside: float = 0.0

    @property
    def focal(self) -> float:
        """Distance of that camera from the picture, px; 0 without a camera."""
        return self.apex[2] if self.apex else 0.0


@dataclass(frozen=True, slots=True)
class View:
    """A camera: its position and target point in the scene, px, and its vertical field of view, rad."""

    position: NDArray[np.float64]
    target: NDArray[np.float64]
    fov_rad: float

    @property
    def distance(self) -> float:
        """Distance from the camera to its target point, px."""
        return float(np.linalg.norm(self.position - self.target))


Side: TypeAlias = Callable[[Box, float], View]
"""Preset for a world next to the picture."""


def fit(preset: Preset, box: Box, aspect: float, margin: float = 1.03) -> View:
    """Return the view of a preset that just contains a box.

    Args:
        preset: Direction and field of view.
        box: The box to show.
        aspect: The window's width over its height.
        margin: Factor of free space around the box.
    """
    depths = (-box.behind, box.depth) if preset.deep else (0.0, 0.0)
    rows, end = (0.5 - box.height, 0.5), box.width - 0.5
    corners = np.array(
        [
            *itertools.product((-0.5, end), rows, depths),
            *((end + box.beside, row, 0.0) for row in rows),
            *([box.apex] if preset.whole and box.apex else []),
        ]
    )
    towards = np.array(preset.direction) / np.linalg.norm(preset.direction)
    right = np.cross((0.0, 1.0, 0.0), towards)
    right /= np.linalg.norm(right)
    # Centre the projected box rather than the box itself.
    axes = np.stack((right, np.cross(towards, right), towards))
    seen = corners @ axes.T
    target = (seen.min(axis=0) + seen.max(axis=0)) / 2.0 @ axes
    across, upwards, ahead = (seen - target @ axes.T).T
    needed = np.maximum(np.abs(upwards), np.abs(across) / max(aspect, 0.1)) * margin / np.tan(preset.fov_rad / 2.0)
    return View(target + towards * float((needed + ahead).max()), target, preset.fov_rad)


@dataclass(slots=True)
class _Watcher:
    client: viser.ClientHandle
    raises: bool  # whether the heights grow when its camera is tilted
    came_from: NDArray[np.float64]  # position of the camera when the browser joined
    preset: str = FIRST
    view: View | None = None
    before: NDArray[np.float64] | None = None  # position of the camera when it was sent to the view
    aspect: float = 1.0
    tilt: float = 0.0
    arrived: bool = False

    def is_in_place(self, camera: viser.CameraHandle) -> bool:
        """Whether the camera is at the view that it was sent to."""
        return self.view is not None and _stands(camera, self.view, 0.01)


def _alike(before: float, now: float) -> bool:
    return 0.7 < (now + 1.0) / (before + 1.0) < 1.3


def _stands(camera: viser.CameraHandle, view: View, share: float) -> bool:
    return float(np.linalg.norm(camera.position - view.position)) < share * view.distance


class Cameras:
    """The cameras of all browsers on a session.

    Args:
        server: The session's viser server.
        on_relief: Called when the heights in the scene should change, because a person tilts the camera.
        sides: Presets other than the picture's, by name: (box of the picture, the window's aspect) -> view.
    """

    def __init__(
        self, server: viser.ViserServer, on_relief: Callable[[], None], sides: Mapping[str, Side] | None = None
    ) -> None:
        self._server = server
        self._sides = dict(sides or {})
        self._on_relief = on_relief
        self._watchers: dict[int, _Watcher] = {}
        self._box: Box | None = None
        self._fitted: Box | None = None
        self._start: View | None = None

    @property
    def relief(self) -> float:
        """Factor on the heights, 0 to 1, by the largest tilt among browsers that raise them; 1 if there are none."""
        tilt = max((each.tilt for each in self._watchers.values() if each.raises), default=FULL_RELIEF_RAD)
        ramp = np.clip((tilt - FLAT_RAD) / (FULL_RELIEF_RAD - FLAT_RAD), 0.0, 1.0)
        return float(np.ceil(ramp * RELIEF_STEPS) / RELIEF_STEPS)

    def set_box(self, box: Box) -> None:
        """Set the extent of the scene; fit a picture of another size again."""
        before, self._box = self._fitted, box
        if before is not None and (before.width, before.height) == (box.width, box.height):
            pairs = (before.depth, box.depth), (before.behind, box.behind), (before.focal, box.focal)
            if not all(_alike(*pair) for pair in pairs):
                self._fitted = box
                # Deep presets are fitted again, unless a person has moved the camera since.
                for watcher in self._watchers.values():
                    is_deep = watcher.preset in PRESETS and PRESETS[watcher.preset].deep
                    if is_deep and (not watcher.arrived or watcher.is_in_place(watcher.client.camera)):
                        self._point(watcher)
            return
        self._fitted = box
        self._start = start = fit(PRESETS[FIRST], box, aspect=1.2)
        camera = self._server.initial_camera
        camera.up = (0.0, 1.0, 0.0)
        camera.position, camera.look_at = start.position, start.target
        camera.fov, camera.near, camera.far = start.fov_rad, start.distance / 50.0, start.distance * 20.0
        for watcher in self._watchers.values():
            watcher.preset = FIRST
            self._point(watcher)

    def join(self, client: viser.ClientHandle, *, looks_only: bool = False) -> None:
        """Fit the picture to the window of a new browser.

        Args:
            client: The browser.
            looks_only: Whether its camera does not affect other browsers.
        """
        watcher = self._watchers[client.client_id] = _Watcher(client, not looks_only, np.array(client.camera.position))
        self._point(watcher)

        @client.camera.on_update
        async def _(camera: viser.CameraHandle) -> None:
            self._on_move(watcher, camera)

    def leave(self, client_id: int) -> None:
        """Forget a browser that has left."""
        before = self.relief
        self._watchers.pop(client_id, None)
        if self.relief != before:
            self._on_relief()

    def look(self, client_id: int, preset: str) -> None:
        """Move one browser's camera to a preset."""
        watcher = self._watchers.get(client_id)
        if watcher is not None:
            watcher.preset = preset
            self._point(watcher)

    def _point(self, watcher: _Watcher) -> None:
        if self._box is None:
            return
        camera = watcher.client.camera
        watcher.aspect, watcher.before = camera.aspect, np.array(camera.position)
        fitted = PRESETS.get(watcher.preset)
        look = self._sides[watcher.preset] if fitted is None else partial(fit, fitted)
        watcher.view = view = look(self._box, watcher.aspect)
        watcher.arrived = False
        with watcher.client.atomic():
            camera.max_orbit_distance = view.distance * 10.0
            camera.min_orbit_distance = view.distance / 20.0
            camera.near, camera.far = view.distance / 50.0, view.distance * 20.0
            camera.fov = view.fov_rad
            camera.up_direction = np.array((0.0, 1.0, 0.0))
            camera.position = view.position
            camera.look_at = view.target
        watcher.client.flush()
        self._tilt(watcher, view.position, view.target)

    def _on_move(self, watcher: _Watcher, camera: viser.CameraHandle) -> None:
        view = watcher.view
        if view is None:
            self._point(watcher)
            return
        there = watcher.is_in_place(camera)
        # While viser sets up a new browser, its camera can jump to its first position and to the start pose, even after
        # it has reached the preset; no person would turn the camera exactly there.
        overtaken = not there and (
            (self._start is not None and _stands(camera, self._start, 1e-4))
            or (watcher.arrived and np.allclose(camera.position, watcher.came_from))
        )
        resized = abs(camera.aspect - watcher.aspect) > 0.005 * watcher.aspect
        watcher.arrived = watcher.arrived or there
        if overtaken or (resized and (there or not watcher.arrived)):
            self._point(watcher)
        elif watcher.arrived or watcher.before is None or not np.allclose(camera.position, watcher.before):
            # The browser has received the new position of its camera.
            self._tilt(watcher, camera.position, camera.look_at)

    def _tilt(self, watcher: _Watcher, position: NDArray[np.float64], target: NDArray[np.float64]) -> None:
        before = self.relief
        towards = position - target
        tilt = float(np.arccos(np.clip(towards[2] / max(float(np.linalg.norm(towards)), 1e-9), -1.0, 1.0)))
        # A camera on another target does not show the picture's heights; a browser may send NaN.
        counts = watcher.preset in PRESETS and np.isfinite(tilt)
        watcher.tilt = tilt if counts else 0.0
        if self.relief != before:
            self._on_relief()
