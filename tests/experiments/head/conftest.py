import numpy as np
import pytest

from pftrack.core.model.parameters import revise
from pftrack.core.model.source import History
from pftrack.experiments.head.scene import HeadSceneParameters, HeadSource


def picture(index: int = 0, **values: object) -> tuple[np.ndarray, np.ndarray]:
    """Return the grey picture of a simulated driver, and where the features truly are."""
    parameters = revise(HeadSceneParameters(), values)
    frame = HeadSource(0, parameters).frame(index, History(((0, parameters),)))
    return np.ascontiguousarray(frame.image_rgb[:, :, 0]), frame.target.landmarks.points_px


@pytest.fixture(scope="session")
def frontal() -> tuple[np.ndarray, np.ndarray]:
    return picture()


@pytest.fixture(scope="session")
def simulated() -> object:
    return picture
