"""The simulated scene: a bright disc runs to the right, turns up or down behind a strip, and comes round again."""

import numpy as np

from pftrack.core.model.source import Frame, History, Target
from pftrack.core.numerics.random import Purpose, Stream
from pftrack.experiments.shared.recording import OverlayParameters, paint, paint_disc

RADIUS_PX, SPEED_PX, NOISE_SD, GREY, BRIGHT = 8.0, 4.7, 4.0, 120, (230, 230, 230)
LEFT_PX, RIGHT_PX, MIDDLE_PX, BEND_PX = 90.0, 230.0, 120.3, 40.0


class Scene:
    """Endless frames of the disc."""

    size, frame_rate_hz, frame_count, noisy = (320, 240), 30.0, None, True

    def __init__(self, seed: int, _parameters: OverlayParameters) -> None:
        self._seed = seed
        self.start = self.target_at(0)

    def frame(self, index: int, history: History[OverlayParameters]) -> Frame:
        """Return a frame; the same arguments give the same frame, to the bit."""
        target, (width, height) = self.target_at(index), self.size
        image = np.full((height, width, 3), GREY, dtype=np.uint8)
        paint_disc(image, *map(float, target.position), RADIUS_PX, BRIGHT)
        paint(image, history.at(index), "#e6e6e6")
        noise = Stream(self._seed, index, Purpose.SCENE).standard_normal((height, width, 1))
        image = np.clip(np.rint(image + NOISE_SD * noise), 0, 255).astype(np.uint8)
        return Frame(index, index / self.frame_rate_hz, image_rgb=image, target=target)

    def target_at(self, index: int) -> Target:
        """Return where the disc is: two straights and two bends a lap, above or below the middle as the seed has it."""
        straight, bend = RIGHT_PX - LEFT_PX, np.pi * BEND_PX
        lap, along = divmod(SPEED_PX * index, 2 * (straight + bend))
        back, along = divmod(along, straight + bend)
        turned = max(along - straight, 0) / BEND_PX
        x, y = LEFT_PX + min(along, straight) + BEND_PX * np.sin(turned), BEND_PX * (1 - np.cos(turned))
        if back:
            x, y = LEFT_PX + RIGHT_PX - x, 2 * BEND_PX - y
        side = 1 if Stream(self._seed, int(lap), Purpose.SCENE).random() < 0.5 else -1
        return Target(np.array([x, MIDDLE_PX + side * y]), 2 * RADIUS_PX)
