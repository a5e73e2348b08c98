"""A run's scene, frame after frame, as a browser shows it again without a server.

The scene is the live one (`pftrack_server.viewer.scene`), followed by a recorder in place of browsers. A live scene is
flat for whoever looks from the front and rises as the camera is tilted, for which the server computes it again. Here
both ends of that are recorded, and the page goes between them.
"""

from collections.abc import Generator, Iterator
from dataclasses import dataclass, replace
from functools import partial
from typing import Any, TypeAlias

import numpy as np
import viser

from pftrack.core.model.drawing import COLOURS, Drawing, Key, Points, drawn_keys, hexadecimal, sort_keys
from pftrack.core.model.faults import without_faults
from pftrack.runs.run import Run
from pftrack_server.core.pictures import PictureEncoder
from pftrack_server.viewer import viser_adapter, worlds
from pftrack_server.viewer.camera import PRESETS, Box, Side, fit
from pftrack_server.viewer.scene import Scene
from pftrack_server.viewer.standalone.packing import Packing
from pftrack_server.viewer.standalone.pictures import shrink

MOST_FRAMES = 1500
"""Of a longer run every second frame is shown, or every third, and so on."""
MOST_POINTS = 1500
"""Of a larger cloud every second point is shown, or every third, and so on."""
ASPECTS = (0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 1.0, 1.2, 1.4, 1.7, 2.0, 2.5, 3.0, 4.0)
"""Of windows, for which views are given; those between lie between them."""


@dataclass(frozen=True, slots=True)
class Recording:
    """What the page's scene needs.

    Attributes:
        player: viser's client as the player of a recording, a page.
        packed: The description and the arrays, packed.
        pictures: JPEG files.
        kept: The frames that it has.
        captions: Of these.
        views: Ways to look, the picture's and those of its worlds.
        layers: Names and titles of what can be switched off.
        legend: Colours, as CSS writes them, and what they mean.
        thinned: For how many points of the largest cloud one stands.
    """

    player: str
    packed: bytes
    pictures: tuple[bytes, ...]
    kept: list[int]
    captions: list[str]
    views: list[dict[str, Any]]
    layers: list[tuple[str, str]]
    legend: list[tuple[str, str]]
    thinned: int


Recorded: TypeAlias = Generator[tuple[int, int], None, Recording]
"""Yields how many frames are done, of how many, and returns the recording."""


def record(run: Run, most_bytes: int) -> Recorded:
    """Record the scene of all frames of a run that were computed.

    Args:
        run: As far as it has been computed; it is moved to each of its frames.
        most_bytes: That the recording may take, of which pictures get what is left by the rest.
    """
    server, _ = viser_adapter.start(run.experiment.title)
    try:
        return (yield from _record(run, server, most_bytes))
    finally:
        viser_adapter.stop(server)


def _record(run: Run, server: viser.ViserServer, most_bytes: int) -> Recorded:
    recorder, packing = viser_adapter.Recorder(server), Packing()
    scene = Scene(server, run.experiment.layers)
    player = viser_adapter.player_page(server)
    encoder, box, thinned = PictureEncoder(), Box(1.0, 1.0), 1
    kept, captions, moments = [], [], []
    keys: set[Key] = set()
    for drawing, frame in _drawings(run):
        drawn, ratio = _thin(drawing)
        thinned = max(thinned, ratio)
        for_scene, layers, both = encoder.for_scene(drawn), _layers(drawn), []
        for relief in (0.0, 1.0):
            scene.apply(for_scene, relief)
            both.append(packing.moment(_visible(recorder.moment), layers))
        kept.append(frame)
        captions.append(drawing.caption)
        moments.append(both)
        box = _larger(box, scene.box(drawn))
        keys.update(key for _, key in drawn_keys(drawing, run.experiment.layers))
        yield frame + 1, run.computed + 1
    packed = packing.pack(moments)
    return Recording(
        player=player,
        packed=packed,
        pictures=tuple(shrink(packing.pictures, max(0, most_bytes - len(packed)))),
        kept=kept,
        captions=captions,
        views=_views(run, box),
        layers=[(layer.name, layer.title) for layer in run.experiment.layers if layer.name in packing.layers],
        legend=[(hexadecimal(COLOURS[key.colour]), key.meaning) for key in sort_keys(keys)],
        thinned=thinned,
    )


def _drawings(run: Run) -> Iterator[tuple[Drawing, int]]:
    every = -(-(run.computed + 1) // MOST_FRAMES)
    for frame in range(0, run.computed + 1, every):
        step = run.seek(frame)
        yield without_faults(run.experiment.draw(step, run.diagnostics)), frame


def _thin(drawing: Drawing) -> tuple[Drawing, int]:
    """Return a drawing whose clouds are not too large, and how many points one stands for.

    Points are in order from left to right, in which they take a third less room.
    """
    clouds = {name: item for name, item in drawing.primitives.items() if isinstance(item, Points)}
    every = max(1, -(-max((len(item.positions) for item in clouds.values()), default=0) // MOST_POINTS))
    return replace(drawing, primitives={**drawing.primitives, **{k: _order(v) for k, v in clouds.items()}}), every


def _order(cloud: Points) -> Points:
    every = max(1, -(-len(cloud.positions) // MOST_POINTS))
    kept = np.arange(0, len(cloud.positions), every)
    order = kept[np.argsort(cloud.positions[kept, 0], kind="stable")]
    return replace(cloud, positions=cloud.positions[order], colours=cloud.colours[order])


def _layers(drawing: Drawing) -> dict[str, str]:
    """Return the layers of a drawing by the names of their nodes."""
    items = [*drawing.primitives.items(), *worlds.place_worlds(drawing)]
    return {f"/{name}": item.layer for name, item in items}


def _visible(moment: viser_adapter.Moment) -> viser_adapter.Moment:
    """Return the nodes that are shown, and those that carry the colours of others."""
    return {name: node for name, node in moment.items() if node.visible or viser_adapter.is_companion(name)}


def _larger(one: Box, other: Box) -> Box:
    return Box(other.width, other.height, max(one.depth, other.depth), other.apex or one.apex)


def _views(run: Run, box: Box) -> list[dict[str, Any]]:
    """Return all ways to look, the picture's and those of its worlds."""
    ways: list[tuple[str, str, Side]] = [(name, preset.title, partial(fit, preset)) for name, preset in PRESETS.items()]
    sides = worlds.sides(run.experiment.worlds)
    for world in run.experiment.worlds:
        titles = {worlds.preset(world, point): f"{world.title}: {point.title}" for point in world.viewpoints}
        ways += [(name, title, sides[name]) for name, title in titles.items()]
    return [_view(name, title, side, box, beside=name not in PRESETS) for name, title, side in ways]


def _view(name: str, title: str, side: Side, box: Box, *, beside: bool) -> dict[str, Any]:
    """Return a way to look: a direction, and how far away to stand for the window's aspect."""
    views = [side(box, aspect) for aspect in ASPECTS]
    towards = (views[0].position - views[0].target) / views[0].distance
    return {
        "name": name,
        "title": title,
        "beside": beside,
        "target": views[0].target.tolist(),
        "towards": towards.tolist(),
        "fov": views[0].fov_rad,
        "distances": [round(view.distance, 2) for view in views],
        "aspects": list(ASPECTS),
    }
