"""The REST interface and the streams: handlers of a few lines over typed dependencies, each beside its subject.

Each handler asks for what it needs, makes one call, and returns a model. Everything that can go wrong is an exception
that `pftrack_server.core.errors` turns into the one error shape.
"""

from fastapi import APIRouter

from pftrack_server.sessions import routes as sessions
from pftrack_server.sweeps import routes as sweeps
from pftrack_server.uploads import routes as uploads
from pftrack_server.web import experiments, failures, health
from pftrack_server.work import jobs
from pftrack_server.work import routes as work

router = APIRouter(prefix="/api/v1")
subjects = uploads, sessions, jobs, work, failures, sweeps
beside = experiments.plugins, experiments.glossary, experiments.own_filters, health.compiling, jobs.source_code
for part in (experiments.router, *beside, *(subject.router for subject in subjects)):
    router.include_router(part)
