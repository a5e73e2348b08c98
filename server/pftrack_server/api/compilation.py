"""Compiling: how far it is."""

from fastapi import APIRouter

from pftrack_server.api.dependencies import TheServices
from pftrack_server.schemas.compilation import CompilationPublic

router = APIRouter(prefix="/compilation", tags=["health"])


@router.get("")
def show_compilation(services: TheServices) -> CompilationPublic:
    """Tell how far compiling is, which is needed once after an installation or an update."""
    progress = services.compilation.progress
    return CompilationPublic(
        finished=progress.finished,
        sentence=progress.sentence,
        done=progress.done,
        total=progress.total,
        seconds_left=progress.left_s,
        usable=sorted(services.compilation.usable),
        ready=sorted(services.compilation.ready),
    )
