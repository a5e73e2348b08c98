"""The REST interface and the stream: handlers of a few lines over typed dependencies.

Each handler asks for what it needs, makes one call, and returns a model. Everything that can go wrong is an exception
that `pftrack_server.errors` turns into the one error shape.
"""

from fastapi import APIRouter

from pftrack_server.api import (
    comparisons,
    compilation,
    experiments,
    explorations,
    exports,
    failures,
    filters,
    fits,
    follow,
    follows,
    glossary,
    lectures,
    lessons,
    polls,
    queue,
    runs,
    sessions,
    source_code,
    stream,
    sweep_files,
    sweep_stream,
    sweeps,
    uploads,
    work,
)

__all__ = ["router"]

router = APIRouter(prefix="/api/v1")
router.include_router(experiments.plugins)
of_sessions = sessions, explorations, stream, exports, fits
computing = compilation, queue, *of_sessions, runs, work, lessons, failures, comparisons
classes = follows, follow, polls, lectures
code = filters, source_code
for part in (experiments, glossary, uploads, *computing, *classes, *code, sweeps, sweep_files, sweep_stream):
    router.include_router(part.router)
