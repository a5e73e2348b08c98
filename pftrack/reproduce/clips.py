"""Recordings with truth, each taken in many ways: what trackers do in real pictures, and not in one run of each.

A clip is a folder with `clip.mp4` and `gt.csv`, the true boxes by number of the picture. A number draws one way to take
it: where it begins, forwards or backwards, every picture or every second, mirrored, darker, noisier, with a grey pillar
over it; and for the tracker its particles and its seed. The same number is the same run on every machine.
"""

from collections.abc import Mapping, Sequence
from contextlib import closing
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from types import MappingProxyType
from zlib import crc32

import numpy as np
from numpy.typing import NDArray

from pftrack.experiment import Experiment, Setup
from pftrack.model.marks import Box
from pftrack.model.parameters import ParameterError, Value, with_role
from pftrack.model.sequence import FrameIndex
from pftrack.numerics.random import Purpose, Stream
from pftrack.runs.run import Change, Run
from pftrack.sources.overlay import OccluderParameters, paint_strip
from pftrack.sources.sequence import open_sequence
from pftrack.sources.truth import TruthTable, read_truth

__all__ = ["FRAMES", "Taken", "clips_in", "run_on", "seed_of", "take"]

FRAMES, FEWEST = 100, 25
"""A run has at most so many pictures, and at least so many."""

PARTICLES = 0.25, 0.5, 1.0, 1.0, 2.0
"""Of which one is drawn: as many particles as the experiment takes on a recording, times this."""

NOISE_SD = 0.0, 0.0, 0.0, 6.0, 12.0
SHIFT_PX = 37, 53
"""Noise is drawn once for all pictures of a run, and shifted so far from one to the next."""

GAINS = 1.0, 1.0, 1.0, 0.6, 0.4
"""By which pictures become darker, evenly from the first picture to the last."""

PILLARS = 0.0, 0.0, 1.5, 3.0, 5.0
"""Width of the pillar, in widths of the target; it stands where the target is in a picture that is drawn."""


@dataclass(frozen=True, eq=False)
class Taken:
    """A clip as it is taken once: a sequence of pictures, and its truth.

    Attributes:
        index: Of the pictures as they are taken.
        name: Of the clip.
        pictures: (height, width, 3) RGB each.
        boxes: x, y, w and h by number of the picture, px.
        particles: By how much more particles are taken than usual.
    """

    index: FrameIndex
    name: str
    pictures: Sequence[NDArray[np.uint8]]
    boxes: Mapping[int, tuple[float, float, float, float]]
    particles: float
    square: bool = True

    @property
    def frame_count(self) -> int:
        """How many pictures there are."""
        return len(self.pictures)

    @property
    def frame_rate_hz(self) -> float:
        """Pictures a second."""
        return self.index.frame_rate_hz

    @property
    def size(self) -> tuple[int, int]:
        """Width and height, px."""
        return self.index.width, self.index.height

    @property
    def sha256(self) -> str:
        """Digest of the clip."""
        return self.index.sha256

    @property
    def times_s(self) -> NDArray[np.float64]:
        """When each is shown, s."""
        return np.array(self.index.times_s)

    def picture(self, index: int) -> NDArray[np.uint8]:
        """Return a picture."""
        return self.pictures[index]

    def close(self) -> None:
        """Nothing is open."""


def clips_in(folder: Path) -> list[str]:
    """Return the names of the clips in a folder, in order: those of the folders with a clip and its truth."""
    return sorted(
        each.name for each in folder.iterdir() if (each / "clip.mp4").is_file() and (each / "gt.csv").is_file()
    )


def take(folder: Path, name: str, number: int) -> Taken | None:
    """Return a clip as a number has it; None if that leaves too few pictures."""
    truth = read_truth(folder / name / "gt.csv").boxes
    seed = seed_of(name, number)
    chance = Stream(seed, 0, Purpose.SCENE).random(9)
    path = folder / name / "clip.mp4"
    with closing(open_sequence(path, index=_survey(path))) as clip:
        stride, backwards = 1 + int(chance[0] < 0.25), chance[1] < 0.4
        begins = [frame for frame in truth if _leaves(frame, clip.frame_count, stride, backwards=backwards) >= FEWEST]
        if not begins:
            return None
        begin = begins[int(chance[2] * len(begins))]
        count = min(FRAMES, _leaves(begin, clip.frame_count, stride, backwards=backwards))
        numbers = [begin + stride * (-place if backwards else place) for place in range(count)]
        by_number = {each: clip.picture(each) for each in sorted(numbers)}
        index = clip.index
    pictures = [by_number[each] for each in numbers]
    boxes = {place: truth[each] for place, each in enumerate(numbers) if each in truth}
    if chance[3] < 0.5:
        pictures = [picture[:, ::-1] for picture in pictures]
        boxes = {place: (index.width - x - w, y, w, h) for place, (x, y, w, h) in boxes.items()}
    pillar = _pillar(_choose(PILLARS, chance[4]), float(chance[5]), boxes, index.width)
    noise, gain = _choose(NOISE_SD, chance[6]), _choose(GAINS, chance[7])
    grain = noise * Stream(seed, 1, Purpose.SCENE).standard_normal(pictures[0].shape) if noise else np.zeros(1)
    changed = [
        _change(picture, 1.0 + place / count * (gain - 1.0), _shift(grain, place), pillar)
        for place, picture in enumerate(pictures)
    ]
    rate = index.frame_rate_hz
    taken = FrameIndex("images", index.sha256, index.width, index.height, rate, tuple(np.arange(count) / rate), ())
    return Taken(taken, name, changed, MappingProxyType(boxes), _choose(PARTICLES, chance[8]))


def seed_of(name: str, number: int) -> int:
    """Return what all random numbers of a clip come from as a number has it."""
    return crc32(name.encode()) << 16 | number


def run_on(experiment: Experiment, tracker: str, taken: Taken, seed: int) -> Run | None:
    """Return the finished run of a tracker on what was taken of a clip; None if it cannot begin there."""
    truth = TruthTable(taken.boxes)
    try:
        mark = Box.of(*taken.boxes[0])
        setup = experiment.on_video(taken, mark, start=0, truth=truth) if experiment.on_video else None
    except (ParameterError, ValueError):
        return None
    if setup is None:
        return None
    run = Run(
        experiment,
        setup,
        tracker=tracker,
        seed=seed,
        frames=taken.frame_count,
        timeline=(Change(0, _particles(setup, taken.particles)),),
    )
    run.finish()
    return run


@cache
def _survey(path: Path) -> FrameIndex:
    """Return what a clip is, which takes as long as to decode all of it, once in a process."""
    with closing(open_sequence(path)) as clip:
        return clip.index


def _leaves(begin: int, count: int, stride: int, *, backwards: bool) -> int:
    """Return how many pictures there are from one on."""
    return (begin if backwards else count - 1 - begin) // stride + 1


def _choose(values: Sequence[float], chance: float) -> float:
    return values[int(chance * len(values))]


def _particles(setup: Setup, times: float) -> dict[str, Value]:
    usual = setup.parameters
    return {item.name: round(times * getattr(usual, item.name)) for item in with_role(type(usual), "particles")}


def _pillar(
    widths: float, chance: float, boxes: Mapping[int, tuple[float, float, float, float]], across: int
) -> OccluderParameters:
    """Return a pillar where the target is some pictures after the first, but is not in the first one."""
    x, _, w, _ = list(boxes.values())[int(chance * len(boxes))]
    first, _, begun, _ = boxes[0]
    width = min(widths * w, 640.0, 2.0 * max(abs(x + w / 2 - first - begun / 2) - begun, 0.0))
    return OccluderParameters(
        occlusion_width_px=round(width), occlusion_offset_px=round(x + w / 2 - across / 2), occluder_colour="#6e6e6e"
    )


def _shift(grain: NDArray[np.float64], place: int) -> NDArray[np.float64]:
    down, across = SHIFT_PX
    return np.roll(grain, (place * down, place * across), (0, 1)) if grain.ndim > 1 else grain


def _change(
    picture: NDArray[np.uint8], gain: float, grain: NDArray[np.float64], pillar: OccluderParameters
) -> NDArray[np.uint8]:
    image: NDArray[np.uint8] = np.clip(np.rint(gain * picture + grain), 0, 255).astype(np.uint8)
    paint_strip(image, pillar)
    image.flags.writeable = False
    return image
