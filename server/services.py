"""Services: what the handlers work with, made when the app starts and closed when it stops."""

import asyncio
from dataclasses import dataclass
from typing import Self

from server.metrics import Metrics
from server.sessions import forkserver
from server.sessions.errands import Errands
from server.sessions.manager import Manager
from server.settings import Settings
from server.store import Store

__all__ = ["Services"]

ERRAND_MEMORY_BYTES = 1 << 30


@dataclass(frozen=True)
class Services:
    """What the handlers work with."""

    settings: Settings
    store: Store
    manager: Manager
    errands: Errands
    metrics: Metrics

    @classmethod
    async def open(cls, settings: Settings, metrics: Metrics) -> Self:
        """Open the store, take over its sessions and have the forkserver import what workers need meanwhile."""
        await asyncio.to_thread(forkserver.start)
        store = await asyncio.to_thread(Store, settings)
        manager = Manager(settings, store)
        await manager.open()
        metrics.watch(manager)
        return cls(settings, store, manager, Errands(memory_bytes=ERRAND_MEMORY_BYTES), metrics)

    async def close(self) -> None:
        """Write everything down and let go of it."""
        await self.manager.close()
        await asyncio.to_thread(self.store.close)
