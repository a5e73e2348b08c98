"""Each experiment brings a small picture, and it shows today's scene."""

import cv2
import numpy as np
import pytest

from pftrack.experiments import EXPERIMENTS
from tools.thumbnails import LARGEST_BYTES, draw

COARSE = (16, 12)
LIKE = 6.0
"""Largest mean distance of the coarse pictures' grey levels: packing costs at most 2, another scene more than 10."""


@pytest.mark.slow
@pytest.mark.parametrize("name", EXPERIMENTS.own)
def test_a_thumbnail_shows_the_scene_as_it_is_today(name: str) -> None:
    """What is drawn anew looks alike from afar; if not, `python -m tools.thumbnails` draws them again."""
    path = EXPERIMENTS[name].display.thumbnail
    assert path.stat().st_size <= LARGEST_BYTES
    packed = cv2.cvtColor(cv2.imread(str(path)), cv2.COLOR_BGR2RGB)
    seen, today = (cv2.resize(it, COARSE, interpolation=cv2.INTER_AREA) for it in (packed, draw(EXPERIMENTS[name])))
    assert np.abs(seen.astype(float) - today).mean() < LIKE
