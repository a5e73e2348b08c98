"""Marks: what a person or a finder says of a target in one picture of a recording.

A mark is a small frozen value with a `kind`. A kind knows how to read itself from text and JSON, whether it fits a
picture, how it is drawn, and how it describes itself to an editor: which handles can be dragged, which lines join them,
which numbers go with them. Command line, REST interface, saved runs and the page's editors ask the kind and know none
by name; which kinds an experiment takes is declared by the experiment, so that one from outside can bring its own.

- `mark`: what every kind answers, and the description of an editor;
- `box`: a rectangle around the target;
- `points`: named points on the target;
- `body`: head, root and tip of the tail, and width of a long body.
"""

from pftrack.core.model.marks.body import LongBody
from pftrack.core.model.marks.box import Box
from pftrack.core.model.marks.mark import Editor, Handle, Mark, MarkNumber, read_mark
from pftrack.core.model.marks.points import FeaturePoints

__all__ = ["Box", "Editor", "FeaturePoints", "Handle", "LongBody", "Mark", "MarkNumber", "read_mark"]
