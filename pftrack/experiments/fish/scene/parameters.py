"""What can be turned in the simulated tank."""

from pftrack.core.model.parameters import parameter
from pftrack.experiments.fish.scene.swimming import TankName
from pftrack.sources.overlay import OverlayParameters

__all__ = ["FishSceneParameters"]

TANK = "Tank"


class FishSceneParameters(OverlayParameters):
    """The scene: which clip, how many fish, how they turn, and what is laid over the picture."""

    tank_number: int = parameter(
        200,
        "Clip",
        "Which clip is seen: the seed of the swimming, of the gravel and of the noise. The paper's test is done on "
        "200 to 211, and what the trackers know was learned on 100 to 109.",
        ge=0,
        le=9999,
        step=1,
        live=False,
        group=TANK,
    )
    fish_count: int = parameter(2, "Fish", "How many fish swim.", ge=1, le=2, step=1, live=False, group=TANK)
    lively: bool = parameter(
        True,
        "Lively first fish",
        "Whether the first fish turns sharply at least once: by 60 degrees within four frames.",
        live=False,
        group=TANK,
    )
    followed_fish: int = parameter(
        1,
        "Followed fish",
        "Which of them is tracked; the second is always calm.",
        ge=1,
        le=2,
        step=1,
        live=False,
        group=TANK,
    )
    tank: TankName = parameter(
        "goldfish",
        "Water",
        "How the water answers a bend. With the strong rudder the return stroke turns a fish the same way as the bend, "
        "so that bend and turn are not coupled with one sign.",
        live=False,
        group=TANK,
    )
    image_noise: int = parameter(
        9,
        "Pixel noise",
        "Largest noise of every pixel and channel; it is uniform.",
        unit="grey levels",
        ge=0,
        le=60,
        step=1,
        group=TANK,
        role="world",
    )
