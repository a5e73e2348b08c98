"""What the server tells of compiling."""

from pydantic import BaseModel, Field


class CompilationPublic(BaseModel):
    """How far compiling is, which is needed once after an installation or an update."""

    finished: bool
    sentence: str = Field(description='In words: "compiling, 14 of 41 functions, about 40 s, only once"')
    done: int = Field(description="Functions that are compiled")
    total: int = Field(description="Functions that there are; 0 while that is not known")
    seconds_left: float | None = Field(description="About how long it will go on; null while that is not known")
    usable: list[str] = Field(description="Experiments of which sessions can be started")
    ready: list[str] = Field(description="Experiments of which everything is compiled")
