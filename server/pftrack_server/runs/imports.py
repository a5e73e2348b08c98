"""Imports: saved runs that were sent and are computed once before they are kept, which may take minutes."""

import shutil
from pathlib import Path
from typing import TypeAlias

from pftrack_server.errors import UnavailableError
from pftrack_server.runs.service import bring_in
from pftrack_server.settings import Settings
from pftrack_server.store import Store
from pftrack_server.store.tables import RunRow
from pftrack_server.tasks.child_tasks import ChildTasks
from pftrack_server.tasks.jobs import Job, Jobs
from pftrack_server.uploads.multipart import Received

Import: TypeAlias = Job[str, RunRow]
"""A run that is being brought in; what is known of it from the start is the name of its file."""


class Imports(Jobs[str, RunRow]):
    """All imports of a server."""

    def __init__(self, settings: Settings, store: Store, tasks: ChildTasks) -> None:
        super().__init__("import")
        self._settings = settings
        self._store = store
        self._tasks = tasks

    def bring_in(self, folder: Path, received: Received) -> Import:
        """Begin to bring in a file that has arrived in a folder of its own, which is removed in the end.

        Raises:
            UnavailableError: There are as many under way as there may be.
        """
        try:
            self.check_room()
        except UnavailableError:
            shutil.rmtree(folder, ignore_errors=True)
            raise
        return self.begin(
            received.names[0],
            lambda on_step: bring_in(self._store, self._tasks, self._settings, folder, received, on_step),
        )
