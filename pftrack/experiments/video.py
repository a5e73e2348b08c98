"""Recordings: how an experiment follows a target in pictures or tables that somebody brings.

An experiment declares in one place which kinds of recording and of mark it takes, and how it is wired to them. What all
wirings have in common is done here: the mark and the first picture are looked at before an experiment sees them.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any, TypeAlias

from pftrack.core.model.marks import Mark, read_mark
from pftrack.core.model.parameters import ParameterError, Parameters
from pftrack.core.model.recipe import Footage
from pftrack.core.model.setup import Finder, Setup, Suits
from pftrack.core.model.source import FrameSequence, Kind, Truth
from pftrack.sources.truth import BOXES, TruthKind

PICTURES: tuple[Kind, ...] = ("video", "gif", "images")
"""The kinds of recording that are made of pictures."""

Wire: TypeAlias = Callable[[FrameSequence, Any, int, Truth | None], Setup]
"""(recording, mark in the picture to start at, number of that picture, truth where it is known) -> setup."""


@dataclass(frozen=True)
class Video:
    """How recordings are followed.

    Attributes:
        wire: Wires a recording. It gets a mark of one of the kinds that are taken, which lies in the picture, or None
            where that is allowed. A setup without footage gets that of the recording and the mark.
        footage: The kinds of recording that are taken, of pictures by default; none if nothing can be brought.
        recorded: (kind of a recording) -> the parameters of runs on it, before they are fitted to a target; they are
            needed where a sweep on a recording is planned.
        marks: The kinds of mark that are taken; the first is the one that an editor offers. Where there are none, all
            of a recording is followed.
        wanted: What a mark has to be, for the sentence that refuses another one.
        unmarked: The kinds of recording that may come without a mark all the same, since all of one may be the target.
        advice: What a person who marks the target should know, a sentence.
        finder: How the target is found without a mark, where it can be.
        suits: How to see whether a target in a recording can be followed, where that can be told.
        truth: The kind of truth that comes with a recording; None where there is none to be given.
        clip_title: Name of the experiment on the screen where a recording is tracked, by what it follows; its title if
            empty.
        clip_about: Names of the parameters to turn first on a recording; if there are none, those of presets.
    """

    wire: Wire
    footage: tuple[Kind, ...] = PICTURES
    recorded: Callable[[Kind], Parameters] | None = None
    marks: tuple[type[Mark], ...] = ()
    wanted: str = "left out: all of the recording is followed"
    unmarked: tuple[Kind, ...] = ()
    advice: str = ""
    finder: Finder | None = None
    suits: Suits | None = None
    truth: TruthKind | None = BOXES
    clip_title: str = ""
    clip_about: tuple[str, ...] = ()

    def on_video(
        self, sequence: FrameSequence, mark: Mark | None, *, start: int = 0, truth: Truth | None = None
    ) -> Setup:
        """Return the setup of a recording.

        Args:
            sequence: The pictures.
            mark: The target in the picture `start`; None to have it found, where that can be done, or where nothing is
                to be marked.
            start: Number of the picture to start at, or to look for the target from.
            truth: By number of the picture, where it is known.

        Raises:
            ParameterError: The mark is missing, or of a kind that is not taken; or the mark or the start is not within
                the recording.
            ValueError: There is no target in it.
        """
        if not isinstance(mark, self.marks) and (mark is not None or self.needs_mark(sequence.index.kind)):
            raise ParameterError("mark", mark and mark.kind, self.wanted)
        if not 0 <= start < sequence.frame_count:
            raise ParameterError("start", start, f"a frame of the recording, 0 to {sequence.frame_count - 1}")
        if mark is not None and sequence.index.kind in PICTURES:
            mark.check(sequence.size)
        setup = self.wire(sequence, mark, start, truth)
        return setup if setup.footage else replace(setup, footage=Footage.of(sequence, mark, start, truth))

    def needs_mark(self, kind: str) -> bool:
        """Return whether a person has to mark the target in a recording of this kind."""
        return bool(self.marks) and self.finder is None and kind not in self.unmarked

    def mark(self, raw: object) -> Mark:
        """Read a mark of one of the kinds that are taken from JSON values.

        Raises:
            ParameterError: They are no mark of such a kind.
        """
        return read_mark(self.marks, raw)


def _take_none(sequence: FrameSequence, *_: object) -> Setup:
    raise ParameterError("footage", sequence.index.kind, "left out: no recording is taken")


NO_VIDEO = Video(_take_none, footage=(), truth=None)
"""Where only a simulated scene is followed."""
