"""Compiling: how far it is."""

from typing import Annotated

from fastapi import APIRouter

from pftrack_server.core.compilation import Compilation
from pftrack_server.core.requests import service
from pftrack_server.schemas.compilation import CompilationPublic

router = APIRouter(prefix="/compilation", tags=["health"])


@router.get("")
def show_compilation(compilation: Annotated[Compilation, service(Compilation)]) -> CompilationPublic:
    """Tell how far compiling is, which is needed once after an installation or an update."""
    progress = compilation.progress
    return CompilationPublic(
        finished=progress.finished,
        sentence=progress.sentence,
        done=progress.done,
        total=progress.total,
        seconds_left=progress.left_s,
        usable=sorted(compilation.usable),
        ready=sorted(compilation.ready),
    )
