"""Metrics: what Prometheus may ask of a server."""

import time
from http import HTTPStatus
from typing import get_args

from prometheus_client import CollectorRegistry, Counter, Histogram, generate_latest
from prometheus_client.core import GaugeMetricFamily
from prometheus_client.registry import Collector
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from pftrack_server.sessions.manager import Manager
from pftrack_server.sessions.spec import Phase
from pftrack_server.sweeps.manager import Sweeps
from pftrack_server.sweeps.sweep import State

METHODS = {"GET", "HEAD", "POST", "PUT", "PATCH", "DELETE"}


class Metrics:
    """The counters of one server; a registry of its own, so that tests can make many."""

    def __init__(self) -> None:
        self.registry = CollectorRegistry()
        self.requests = Counter("pftrack_requests", "Requests answered", ["method", "status"], registry=self.registry)
        self.seconds = Histogram("pftrack_request_seconds", "Time to answer a request", registry=self.registry)

    def watch(self, manager: Manager, sweeps: Sweeps) -> None:
        """Report a server's sessions and sweeps from now on."""
        self.registry.register(_Sessions(manager))
        self.registry.register(_Sweeps(sweeps))

    def text(self) -> bytes:
        """Return everything in Prometheus's own format."""
        return generate_latest(self.registry)


class _Sessions(Collector):
    def __init__(self, manager: Manager) -> None:
        self._manager = manager

    def collect(self) -> list[GaugeMetricFamily]:
        """Count sessions and visitors at the moment of asking."""
        states = GaugeMetricFamily("pftrack_sessions", "Sessions by state", labels=["state"])
        found = [session.phase for session in self._manager.all]
        for state in Phase:
            states.add_metric([state], found.count(state))
        visitors = GaugeMetricFamily("pftrack_visitors", "Connections that look on or listen")
        visitors.add_metric([], sum(session.visitors for session in self._manager.all))
        frames = GaugeMetricFamily("pftrack_frames", "Frames computed by all workers since the server started")
        frames.add_metric([], sum(session.state.frames_computed for session in self._manager.all))
        return [states, visitors, frames]


class _Sweeps(Collector):
    def __init__(self, sweeps: Sweeps) -> None:
        self._sweeps = sweeps

    def collect(self) -> list[GaugeMetricFamily]:
        """Count sweeps, runs and visitors at the moment of asking."""
        states = GaugeMetricFamily("pftrack_sweeps", "Sweeps by state", labels=["state"])
        found = [sweep.state for sweep in self._sweeps.all]
        for state in get_args(State):
            states.add_metric([state], found.count(state))
        runs = GaugeMetricFamily("pftrack_sweep_runs", "Runs that are there of all sweeps kept")
        runs.add_metric([], sum(sweep.done for sweep in self._sweeps.all))
        visitors = GaugeMetricFamily("pftrack_sweep_visitors", "Connections that watch a sweep")
        visitors.add_metric([], sum(sweep.listeners for sweep in self._sweeps.all))
        return [states, runs, visitors]


class Stopwatch:
    """ASGI middleware that counts and times every answer."""

    def __init__(self, app: ASGIApp, metrics: Metrics) -> None:
        self._app = app
        self._metrics = metrics

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Time one request."""
        if scope["type"] != "http":
            await self._app(scope, receive, send)
            return
        began = time.perf_counter()
        status = int(HTTPStatus.INTERNAL_SERVER_ERROR)

        async def note(message: Message) -> None:
            nonlocal status
            if message["type"] == "http.response.start":
                status = message["status"]
            await send(message)

        try:
            await self._app(scope, receive, note)
        finally:
            # What a client made up as its method must not become a label of its own.
            method = scope["method"] if scope["method"] in METHODS else "other"
            self._metrics.requests.labels(method, str(status)).inc()
            self._metrics.seconds.observe(time.perf_counter() - began)
