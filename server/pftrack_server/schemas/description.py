"""Descriptions: what is fixed of a session while it lives.

The worker makes one of the experiment's declaration and the run's source, once. From there on it is carried whole: by
the pipe, in the store, to the panel beside the scene and to the pages.
"""

from typing import Literal

from pydantic import BaseModel, ConfigDict, Field

from pftrack.core.model.drawing import Layer, World
from pftrack.core.model.marks import Editor
from pftrack.core.model.measures import How
from pftrack.core.model.parameters import Declaration
from pftrack.core.model.series import Plot, Reading, Series
from pftrack.output.exports.formats import Group


class MeasurePublic(BaseModel):
    """The declaration of a measure."""

    name: str
    title: str
    description: str = Field(description="Its definition, one sentence")
    how: How = Field(description="A share of the frames, their median, or how many there were until one missed")
    unit: str
    better: Literal["higher", "lower"]
    source: str = Field(description="Author, title and year of whoever defined it; empty for the project's own")


class TrackerPublic(BaseModel):
    """A tracker that can be chosen."""

    id: str
    title: str
    replays: bool = Field(False, description="It says again what was recorded; no seed or setting changes that")


class ExportPublic(BaseModel):
    """A file that can be made of a run, or of the frame that is shown."""

    model_config = ConfigDict(from_attributes=True)

    name: str
    title: str
    short: str = Field(description="What it is called beside others of its group; the title if empty")
    suffix: str
    media_type: str
    group: Group = Field(description='What kind of thing it is; of "plots", one plot can be asked for by its id')


class TruthMark(BaseModel):
    """The kind of mark by which a person says what is true of a picture."""

    editor: Editor
    parts: list[str] = Field(description="Where in the mark the values of the columns after the frame's number stand")


class SessionDescription(BaseModel):
    """What is fixed of a session while it lives."""

    title: str
    subject: str = Field("", description="Its clip, or the preset that it began as; empty if it is neither")
    unit: str = "px"
    target: str = "target"
    series: list[Series] = []
    plots: list[Plot] = []
    readings: list[Reading] = []
    measures: list[MeasurePublic] = []
    success_measure: str = Field("", description="Name of the measure that decides on success")
    exports: list[ExportPublic] = Field(
        [], description="Files that can be made of the run, or of the frame that is shown"
    )
    about: list[str] = Field([], description="Parameters to turn first: those that its preset is about")
    watch: str = Field("", description="What to look at, where it began as a preset that says so")
    truth_columns: list[str] = Field([], description="Of a table of truth that can be given; empty if none can")
    truth_mark: TruthMark | None = Field(None, description="How truth is marked in pictures; null if it cannot be")
    declarations: list[Declaration] = []
    trackers: list[TrackerPublic]
    fittable: dict[str, list[str]] = Field({}, description="Numbers that can be fitted to what was seen, by tracker")
    layers: list[Layer] = []
    worlds: list[World] = []
    width: int
    height: int
    frame_rate_hz: float
    frames: int

    def tracker_title(self, tracker: str) -> str:
        """Return what people call a tracker."""
        return next((known.title for known in self.trackers if known.id == tracker), tracker)
