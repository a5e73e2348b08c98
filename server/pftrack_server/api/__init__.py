"""The REST interface and the stream: handlers of a few lines over typed dependencies.

Each handler asks for what it needs, makes one call, and returns a model. Everything that can go wrong is an exception
that `pftrack_server.errors` turns into the one error shape.
"""

from fastapi import APIRouter

from pftrack_server.api import (
    compilation,
    experiments,
    failures,
    filters,
    follow,
    follows,
    glossary,
    jobs,
    lectures,
    lessons,
    polls,
    sessions,
    source_code,
    stream,
    sweeps,
    uploads,
    work,
)

__all__ = ["router"]

router = APIRouter(prefix="/api/v1")
router.include_router(experiments.plugins)
computing = compilation, sessions, stream, jobs, work, lessons, failures
classes = follows, follow, polls, lectures
code = filters, source_code
for part in (experiments, glossary, uploads, *computing, *classes, *code, sweeps):
    router.include_router(part.router)
