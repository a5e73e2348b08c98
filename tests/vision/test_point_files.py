"""Points that are written are read back; what strangers send is refused with a sentence."""

import json
from typing import Any

import numpy as np
import pytest

from pftrack.vision.face import FEATURES, mean_model
from pftrack.vision.model_files import LONGEST_CHARACTERS, as_json, read_points
from tests.vision.refusing import refuse

GOOD = as_json(FEATURES, mean_model().points_mm, frames=3)


def changed(**values: Any) -> str:
    return json.dumps({**json.loads(GOOD), **values})


def points(**values: Any) -> str:
    return changed(points={**json.loads(GOOD)["points"], **values})


def test_points_are_read_back() -> None:
    """To a ten-thousandth of a mm, in the order that is asked for; what else the file says is passed over."""
    for step in (1, -1):
        np.testing.assert_allclose(read_points(GOOD, FEATURES[::step]), mean_model().points_mm[::step], atol=1e-4)
    said = json.loads(GOOD)
    assert (said["unit"], said["frames"]) == ("mm", 3)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("{", "expected a JSON file of points"),
        ("[" * 50_000, "expected a JSON file of points"),
        (b"\xff\xfe\x00", "expected a JSON file of points"),
        ("[]", "format 'pftrack points'"),
        (changed(points=[1, 2]), "format 'pftrack points'"),
        (changed(version=2), "expected version 1 in mm"),
        (points(chin=[0, 0, 0]), "expected a model of 11 points, got 12"),
        (changed(points={str(n): [0, 0, 0] for n in range(11)}), "got none for nose"),
        (points(nose=[1, 2]), r"three numbers \(x, y, z\) for nose"),
        (points(nose=[True, 0, 0]), r"three numbers \(x, y, z\) for nose"),
        (points(nose=[float("nan"), 0, 0]), "-10000 to 10000 mm for nose"),
        (points(nose=[10**400, 0, 0]), "for nose"),
        (" " * (LONGEST_CHARACTERS + 1), f"at most {LONGEST_CHARACTERS} characters, got {LONGEST_CHARACTERS + 1}"),
    ],
)
def test_what_is_no_model_is_refused(text: str | bytes, words: str) -> None:
    """Not JSON, nested without end, another format, unit or number of points, or no numbers: a sentence each."""
    refuse(words, read_points, text, FEATURES)
