"""A tiny sequence of a benchmark, made where it is needed."""

from pathlib import Path

import numpy as np
from PIL import Image

FRAMES = 6
BOX = (20, 14, 12, 16)
"""The box in the first picture, with the first pixel 0; it goes two pixels to the right in each frame."""


def write_pictures(folder: Path, *, grey: bool = False, frames: int = FRAMES) -> None:
    """Write a red rectangle that moves over green."""
    folder.mkdir(parents=True, exist_ok=True)
    x, y, w, h = BOX
    for number in range(frames):
        picture = np.full((64, 96, 3), (40, 120, 60), np.uint8)
        picture[y : y + h, x + 2 * number : x + 2 * number + w] = (200, 40, 40)
        if grey:
            picture[:] = picture.mean(axis=2, keepdims=True).astype(np.uint8)
        Image.fromarray(picture).save(folder / f"{number + 1:04d}.png")


def write_otb(folder: Path, *, separator: str = ",", grey: bool = False) -> Path:
    """Write it as OTB has it."""
    write_pictures(folder / "img", grey=grey)
    x, y, w, h = BOX
    rows = [(x + 1 + 2 * number, y + 1, w, h) for number in range(FRAMES)]
    (folder / "groundtruth_rect.txt").write_text("\n".join(separator.join(map(str, row)) for row in rows) + "\n")
    return folder
