"""What the trackers know of how a fish moves: learned offline from ten clips of the simulated tank.

`learned.json` is written by `pftrack reproduce fish-offline --full --figures FOLDER` from the twenty tracks of clips
100 to 109 that the ordinary filter followed with 3,000 particles and wide noise. It holds the estimates' noise along
with the fish's motion, and that is meant: else there is no room for rare, violent turns.
"""

from pathlib import Path

from pftrack.filters.learning.charts import Chart
from pftrack.filters.learning.guidance import Guidance

__all__ = ["FISH", "GUIDANCE", "LEARNED_HALF_LENGTH_PX"]

FISH = Chart(place=("a", "b"), heading="theta", angles=("phi",))
"""Of a recorded state: the centre of the body, its heading, and the bend of the tail."""

LEARNED_HALF_LENGTH_PX = 40.0
"""Semi-axis of the fish that was learned from; lengths are scaled from it to the fish that is followed."""

GUIDANCE = Guidance(
    experiment="fish",
    chart=FISH,
    built_in=Path(__file__).with_name("learned.json").read_text(encoding="utf-8"),
    series="body",
)
