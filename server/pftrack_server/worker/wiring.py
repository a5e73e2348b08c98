"""Wiring: what a worker's recipe speaks of, found on this machine: the recording, or the simulated scene."""

import dataclasses
from pathlib import Path

from pftrack.core.model.recipe import Footage
from pftrack.core.model.setup import Setup
from pftrack.core.model.source import FrameIndex, FrameSequence
from pftrack.experiments import find
from pftrack.runs import opening
from pftrack.sources.limits import DEFAULT_LIMITS
from pftrack.sources.sequence import open_sequence
from pftrack_server.worker.protocol import WorkerConfig


def wire(config: WorkerConfig) -> Setup:
    """Wire the recipe's footage, which is the upload, or the simulated scene.

    Raises:
        SourceError: The upload cannot be opened.
        RecordError: The upload is another one, or shows no target.
        LookupError: There is no such experiment.
    """
    footage, experiment = config.run.recipe.footage, find(config.run.recipe.experiment)
    if footage is None or config.video is None:
        return experiment.simulate()
    video = Path(config.video)
    limits = dataclasses.replace(DEFAULT_LIMITS, frames=config.max_frames, pixels=config.max_pixels)
    index = FrameIndex.from_json(config.index) if config.index else None

    def open_sequence_of(footage: Footage) -> FrameSequence:
        return open_sequence(video, limits, index=index, square=footage.square)

    setup = opening.wire(experiment, footage, open_sequence_of)
    if setup.footage is None or not footage.name:
        return setup
    # A saved run speaks of the recording by the name that people know.
    return dataclasses.replace(setup, footage=setup.footage.model_copy(update={"name": footage.name}))
