"""Suitability: whether a target in an upload can be followed, looked at in a confined process and kept for a while.

A person draws a box, moves it, and moves it back: what was found lately is kept in memory, so that nothing is looked at
twice. It is small, and none of it is worth a place on the disk.
"""

import json
from collections import OrderedDict
from collections.abc import Mapping
from typing import Any

from pydantic import BaseModel, Field

from pftrack.core.model.setup import Grade
from pftrack.experiments.experiment import Experiment
from pftrack_server.core.settings import Settings
from pftrack_server.jobs.child_tasks import ChildTasks
from pftrack_server.jobs.functions import weigh_target
from pftrack_server.store import Store
from pftrack_server.uploads.intake import index_of, limits_of


class SuitabilityPublic(BaseModel):
    """Whether a target can be followed, looked at before it is tracked."""

    value: float = Field(description="0..1, the higher the better")
    grade: Grade = Field(description="The same in words")
    remark: str = Field(description="What was found, a sentence")
    advice: list[str] = Field(description="What would help, a sentence each")
    better: dict[str, Any] | None = Field(
        description="A mark of the same target that suits better; null if none is known"
    )
    picture: str | None = Field(
        description="The likelihood over the picture as a data address, from purple for 0 to yellow for its peak; null "
        "for a likelihood that is not one of places"
    )


MOST_KEPT = 64


class Suitabilities:
    """What was found of targets, the newest last."""

    def __init__(self, store: Store, settings: Settings) -> None:
        self._store = store
        self._settings = settings
        self._found: OrderedDict[str, SuitabilityPublic] = OrderedDict()

    async def of(
        self, tasks: ChildTasks, upload: str, experiment: Experiment, frame: int, mark: Mapping[str, Any]
    ) -> SuitabilityPublic:
        """Return how suitable a target is.

        Args:
            tasks: Those of the client that asks.
            upload: Name of the upload.
            experiment: Whose trackers are to follow it.
            frame: Number of the picture in which it is marked.
            mark: The target, as JSON values.

        Raises:
            RefusedError: The mark is none that the experiment takes, or is not within the picture.
            UnavailableError: It took too long.
        """
        key = json.dumps([upload, experiment.id, frame, mark], sort_keys=True)
        if key not in self._found:
            where = str(self._store.files.upload(upload))
            index = await index_of(self._store, self._settings, tasks, upload)
            limits = limits_of(self._settings)
            self._found[key] = SuitabilityPublic(
                **await tasks.run(weigh_target, where, index, experiment.id, frame, mark, limits)
            )
            while len(self._found) > MOST_KEPT:
                self._found.popitem(last=False)
        self._found.move_to_end(key)
        return self._found[key]
