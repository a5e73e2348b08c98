"""Compiling: how far it is."""

from typing import Annotated

from fastapi import APIRouter
from pydantic import BaseModel, Field

from pftrack_server.core.compilation import Compilation
from pftrack_server.core.requests import service


class CompilationPublic(BaseModel):
    """How far compiling is, which is needed once after an installation or an update."""

    finished: bool
    sentence: str = Field(description='In words: "compiling, 14 of 41 functions, about 40 s, only once"')
    done: int = Field(description="Functions that are compiled")
    total: int = Field(description="Functions that there are; 0 while that is not known")
    seconds_left: float | None = Field(description="About how long it will go on; null while that is not known")
    usable: list[str] = Field(description="Experiments of which sessions can be started")
    ready: list[str] = Field(description="Experiments of which everything is compiled")


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
