"""Exports of runs."""

from typing import Literal

from pydantic import BaseModel, Field

from pftrack_server.schemas.description import ExportPublic


class PlotChoice(BaseModel):
    """A plot of which a picture can be made."""

    id: str
    title: str


class ExportsPublic(BaseModel):
    """What a saved run can be exported as."""

    exports: list[ExportPublic]
    plots: list[PlotChoice] = Field(description='What `plot` may name for an export of the group "plots"')


class ExportJobPublic(BaseModel):
    """A file that is being written, or what came of it."""

    id: str
    title: str = Field(description="What kind of file it is")
    name: str = Field(description="What the file is called")
    state: Literal["writing", "done", "failed"]
    done: int = Field(description="Steps done; the first half of them compute the run")
    total: int = Field(description="Steps to do; 0 until it has begun")
    file: str = Field(description="Address of the file, once it is there")
    message: str | None = Field(description="Why it failed, if it did")
