"""The checks of marks pass for a kind of one's own, and fail for one that breaks what they are about."""

import json
from collections.abc import Mapping
from dataclasses import replace
from typing import ClassVar, Literal

import numpy as np
import pytest
from pydantic import Field

from pftrack.core.model.drawing import Ellipse, Primitive
from pftrack.core.model.marks import Box, Editor, Handle, Mark, MarkNumber
from pftrack.core.refusal import ParameterError
from pftrack.experiments import find
from pftrack.testing import CheckError, experiment_checks

BALL = find("ball")


class Disc(Mark):
    """A kind that the project does not have."""

    title: ClassVar[str] = "Disc"
    instruction: ClassVar[str] = "Put the disc on the target."

    kind: Literal["disc"] = "disc"
    centre: tuple[float, float]
    radius_px: float = Field(ge=1, le=200)

    def check(self, size: tuple[int, int]) -> None:
        if not all(0 <= place <= extent - 1 for place, extent in zip(self.centre, size, strict=True)):
            raise ParameterError("mark.centre", self.centre, f"within the picture of {size[0]} x {size[1]} px")

    def draw(self) -> Mapping[str, Primitive]:
        axes = np.diag([self.radius_px, self.radius_px]).astype(np.float32)
        return {"disc": Ellipse(np.array([*self.centre, 1.0], np.float32), axes, (0, 114, 178), 2.0, "mark")}

    @classmethod
    def editor(cls) -> Editor:
        radius = MarkNumber(
            name="radius_px", title="Radius", unit="px", minimum=1, maximum=200, step=1, default=20, about="centre"
        )
        return cls.describe(handles=(Handle(name="centre", title="Centre"),), numbers=(radius,))


class Elsewhere(Disc):
    """Drawn on another layer."""

    def draw(self) -> Mapping[str, Primitive]:
        return {"disc": replace(super().draw()["disc"], layer="picture")}


class Anywhere(Disc):
    """Fits every picture."""

    def check(self, size: tuple[int, int]) -> None:
        del size


class Undescribed(Disc):
    """Has a field of which the editor is not told."""

    @classmethod
    def editor(cls) -> Editor:
        return cls.describe(handles=(Handle(name="centre", title="Centre"),))


def run(*kinds: type[Mark]) -> None:
    for check in experiment_checks(replace(BALL, video=replace(BALL.video, marks=kinds))):
        if "mark" in str(check) and "film" not in str(check):
            check()


def test_a_kind_of_one_s_own_is_sound() -> None:
    """A disc of a handle and a radius does all that is asked of a kind, beside a box."""
    run(Disc, Box)


@pytest.mark.parametrize(
    ("kinds", "message"),
    [
        ((Disc, Elsewhere), "must have unique names"),
        ((Elsewhere,), "on the layer 'mark'"),
        ((Anywhere,), "must be refused in a picture of 320 x 240 px, and was accepted"),
        ((Undescribed,), r"mark\.radius_px"),
    ],
)
def test_what_is_wrong_with_a_kind_is_said(kinds: tuple[type[Mark], ...], message: str) -> None:
    """Each check fails for a kind that breaks what it is about, or by the field that a description lacks."""
    with pytest.raises((CheckError, ParameterError), match=message):
        run(*kinds)


def test_it_is_read_from_json() -> None:
    """A kind without a form of text of its own is read from JSON on the command line as well."""
    raw = '{"centre": [4, 5], "radius_px": 3}'
    assert Disc.parse(raw).centre == Disc.read(json.loads(raw)).centre == (4, 5)
    with pytest.raises(ValueError, match=r"the file .* does not exist"):
        Disc.parse("no file")
