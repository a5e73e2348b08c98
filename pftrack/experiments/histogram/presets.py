"""Starting points on the lawn, and seven ways to lose the window there, each with its cure.

What a starting point says to watch holds for its own seed.
"""

from pathlib import Path

from pftrack.core.model.preset import read_failures, read_presets

ABOUT = ("sharpness", "parts_down", "weigh_background", "surround_contrast", "follow_size")
"""Of the lecture's settings and those of recordings, what is worth turning."""

PRESETS = read_presets(Path(__file__).with_name("presets.yaml"))

BEFORE_COLUMN = 80
"""So many frames are over before the target goes behind the column."""

FAILURES = read_failures(Path(__file__).with_name("failures.yaml"))
