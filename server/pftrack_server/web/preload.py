"""The modules that the fork server imports before the first child starts; all children share their memory.

Without it each child would import everything itself: 0.6-1.8 s and 96 MB instead of 15 ms and 20 MB. Compiled code is
loaded later, with the first session of each experiment (`sessions.worker.worker`): all of it takes 190 MB, which few
servers need.
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

PRELOADED = numba, np, pftrack, pftrack_server  # only imported; named here so that linters keep the imports

cv2.setNumThreads(1)
dict(EXPERIMENTS)
