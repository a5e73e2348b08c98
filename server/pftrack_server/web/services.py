"""Services of the handlers, made when the app starts and closed when it stops."""

import asyncio
import threading
from concurrent.futures import ThreadPoolExecutor

from pftrack_server.core.compilation import Compilation
from pftrack_server.core.processes import FORK_SERVER
from pftrack_server.core.settings import Settings
from pftrack_server.jobs.child_tasks import ChildTasks, Queues
from pftrack_server.jobs.jobs import Jobs
from pftrack_server.jobs.results import DiskCache, ExperimentResults
from pftrack_server.sessions.manager import Manager
from pftrack_server.store import Store
from pftrack_server.store.filters import FilterFiles
from pftrack_server.sweeps.manager import Sweeps
from pftrack_server.web.health import Metrics
from pftrack_server.work.explorations import Explorations
from pftrack_server.work.sources import House

THREADS = 32


class Services:
    """The services that handlers use; most are made by `open`.

    Attributes:
        added: Services of parts outside the core, while they are open.
    """

    def __init__(self, settings: Settings, metrics: Metrics) -> None:
        self.settings, self.metrics = settings, metrics
        self.added: list[object] = []
        self.stopping = threading.Event()
        self.queues = Queues()
        self.tasks = ChildTasks(self.queues)

    async def open(self) -> None:
        """Open the store, load sessions and sweeps, and start the fork server, which imports meanwhile."""
        settings, tasks = self.settings, self.tasks
        # Threads here mostly wait for disks and processes; asyncio's default number depends on the processors.
        asyncio.get_running_loop().set_default_executor(ThreadPoolExecutor(THREADS, "pftrack"))
        await asyncio.to_thread(FORK_SERVER.start)
        self.store = store = await asyncio.to_thread(Store, settings)
        self.compilation = await asyncio.to_thread(Compilation.open, self.stopping)
        wait_for = self.compilation.wait_for
        self.manager = Manager(settings, store, tasks, self.compilation.open_experiment)
        await self.manager.open()
        self.filters = await asyncio.to_thread(
            FilterFiles, settings.filters, store.files, editable=settings.edits_filters
        )
        self.sweeps = Sweeps(settings, store, tasks, self.filters)
        await self.sweeps.open()
        self.metrics.watch(self.manager, self.sweeps)
        self.house = House(settings, store, self.manager, self.sweeps, tasks, Jobs(), wait_for)
        self.explorations = Explorations(self.house)
        kept = await asyncio.to_thread(DiskCache, settings.data_dir / "experiments-computed")
        self.results = ExperimentResults(kept, tasks, wait_for)
        self.filters.open(self.manager.revise_filter)

    def __getitem__(self, kind: type) -> object:
        """Return the service of a type."""
        return next(each for each in (*vars(self).values(), *self.added) if isinstance(each, kind))

    async def close(self) -> None:
        """Store everything and close all services."""
        self.stopping.set()
        await asyncio.to_thread(self.compilation.close)
        await self.filters.close()
        parts = self.manager, self.sweeps, self.house.jobs
        await asyncio.gather(*(part.close() for part in parts))
        await asyncio.to_thread(self.store.close)
