"""Tasks: what the server has a child process do with a sweep, as one line of JSON."""

from pathlib import Path
from typing import Annotated, Any, Literal, TypeAlias

from pydantic import BaseModel, Field, TypeAdapter

__all__ = ["TASK", "Measure", "Report", "Resume", "Task"]


class Measure(BaseModel):
    """Measure how long a plan takes.

    Attributes:
        plan: As JSON values.
        jobs: Processes that would compute it.
    """

    kind: Literal["measure"] = "measure"
    plan: dict[str, Any]
    jobs: int
    file_bytes: int = 0


class Resume(BaseModel):
    """Go on with a sweep that was begun.

    Attributes:
        out: Its result file.
        jobs: Processes that compute.
        file_bytes: Length of any file that they write.
    """

    kind: Literal["resume"] = "resume"
    out: Path
    jobs: int
    file_bytes: int


class Report(BaseModel):
    """Write the report of a sweep.

    Attributes:
        result: The sweep's result file.
        folder: Where the report goes.
        file_bytes: Length of any file of it.
    """

    kind: Literal["report"] = "report"
    result: Path
    folder: Path
    file_bytes: int


Task: TypeAlias = Measure | Resume | Report
TASK: TypeAdapter[Task] = TypeAdapter(Annotated[Task, Field(discriminator="kind")])
