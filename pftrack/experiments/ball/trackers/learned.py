"""How a ball's runs are learned from, and what comes with the experiment: `learned.json`.

It was learned from ten runs of the scene without a pillar, `pftrack learn ball` with the options

    --tracker h-spf --frames 120 --set occlusion_width_px=0 --set image_noise_sd=10
    --set sample_count=3000 --set process_noise_px=8
"""

from pathlib import Path

from pftrack.filters.learning.charts import Chart
from pftrack.filters.learning.guidance import Guidance

__all__ = ["GUIDANCE"]

GUIDANCE = Guidance("ball", Chart(place=("u", "v")), Path(__file__).with_name("learned.json").read_text("utf-8"))
