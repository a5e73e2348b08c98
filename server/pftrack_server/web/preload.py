"""The modules that the fork server imports before the first child starts, shared by all children's memory.

Without it each would import everything itself: 0.6-1.8 s and 96 MB in place of 15 ms and 20 MB. What is compiled comes
later, with the first session of each experiment (`sessions.worker.worker`): all of it is 190 MB that few servers need.
"""

import cv2
import numba
import numpy as np

import pftrack.runs.record
import pftrack.sources.beliefs.sequence
import pftrack.sources.images
import pftrack.sources.tracks
import pftrack.sources.video
import pftrack_server.sessions.worker.worker
import pftrack_server.teaching.functions
import pftrack_server.work.run_functions
from pftrack.experiments import EXPERIMENTS

PRELOADED = numba, np, pftrack, pftrack_server  # imported to be there, and named so that they stay imported

cv2.setNumThreads(1)
dict(EXPERIMENTS)
