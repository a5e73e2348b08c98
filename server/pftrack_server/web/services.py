"""Services: what the handlers work with, made when the app starts and closed when it stops."""

import asyncio
import threading
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from typing import Self

from pftrack_server.core.compilation import Compilation
from pftrack_server.core.processes import FORK_SERVER
from pftrack_server.core.settings import Settings
from pftrack_server.jobs.child_tasks import ChildTasks, Queues
from pftrack_server.jobs.jobs import Jobs
from pftrack_server.jobs.results import ExperimentResults
from pftrack_server.sessions.manager import Manager
from pftrack_server.store import Store
from pftrack_server.store.filters import FilterFiles
from pftrack_server.sweeps.manager import Sweeps
from pftrack_server.uploads.routes import Suitabilities
from pftrack_server.web.health import Metrics
from pftrack_server.work.explorations import Explorations
from pftrack_server.work.sources import House

THREADS = 32


@dataclass(frozen=True)
class Services:
    """The services that handlers use.

    Attributes:
        added: Those of the parts beside the core, while they are open.
    """

    settings: Settings
    store: Store
    manager: Manager
    sweeps: Sweeps
    tasks: ChildTasks
    house: House
    explorations: Explorations
    metrics: Metrics
    suitabilities: Suitabilities
    queues: Queues
    compilation: Compilation
    results: ExperimentResults
    filters: FilterFiles
    stopping: threading.Event
    added: list[object] = field(default_factory=list)

    @classmethod
    async def open(cls, settings: Settings, metrics: Metrics) -> Self:
        """Open the store, take over sessions and sweeps, and start the fork server, which imports meanwhile."""
        # Threads here mostly wait, for disks and processes; asyncio's own number of them follows the processors.
        asyncio.get_running_loop().set_default_executor(ThreadPoolExecutor(THREADS, "pftrack"))
        await asyncio.to_thread(FORK_SERVER.start)
        store = await asyncio.to_thread(Store, settings)
        stopping = threading.Event()
        compilation = await asyncio.to_thread(Compilation.open, stopping)
        queues = Queues()
        tasks = ChildTasks(queues)
        manager = Manager(settings, store, tasks, compilation.open_experiment)
        await manager.open()
        filters = await asyncio.to_thread(FilterFiles, settings.filters, store.files, editable=settings.edits_filters)
        sweeps = Sweeps(settings, store, tasks, filters)
        await sweeps.open()
        metrics.watch(manager, sweeps)
        house = House(settings, store, manager, sweeps, tasks, Jobs(), compilation.wait_for)
        kept = Suitabilities(store, settings)
        results = ExperimentResults(settings.data_dir / "experiments-computed", tasks, compilation.wait_for)
        await asyncio.to_thread(results.open)
        filters.open(manager.revise_filter)
        return cls(
            settings,
            store,
            manager,
            sweeps,
            tasks,
            house,
            Explorations(house),
            metrics,
            kept,
            queues,
            compilation,
            results,
            filters,
            stopping,
        )

    def __getitem__(self, kind: type) -> object:
        """Return the service of a kind."""
        return next(each for each in (*vars(self).values(), *self.added) if isinstance(each, kind))

    async def close(self) -> None:
        """Write everything down and let go of it."""
        self.stopping.set()
        await asyncio.to_thread(self.compilation.close)
        await self.filters.close()
        parts = self.manager, self.sweeps, self.house.jobs
        await asyncio.gather(*(part.close() for part in parts))
        await asyncio.to_thread(self.store.close)
