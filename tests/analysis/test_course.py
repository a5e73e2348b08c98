"""The columns of a run by the roles of its series."""

from dataclasses import replace
from typing import Any

import numpy as np

import pftrack
from pftrack.analysis.diagnosis.course import course_of
from pftrack.core.model.series import Series


def test_parts_count_by_their_mean() -> None:
    """The fit of a likeness of several parts is the mean of the known ones; few parts in sight are a hidden target."""
    roles = {"alike": "likeness", "seen": "visible"}
    declared = tuple(Series(name, name, shape="vector", role=role) for name, role in roles.items())
    declared = (*declared, Series("differs", "differs", "%", role="misfit"))
    said: list[dict[str, Any]] = [
        {"alike": (0.5, 1.0), "seen": (1.0, 1.0, 0.0)},
        {"alike": (0.4, float("nan")), "seen": (0.0, 1.0, 0.0)},
        {"alike": (), "seen": (0.0, 0.0, 0.0)},
    ]
    seen = zip(pftrack.run("ball", tracker="kalman", frames=3).diagnostics, said, strict=True)
    rows = [replace(row, series={**values, "differs": 7.0}, hidden=False) for row, values in seen]
    course = course_of(rows, declared, unit="px")
    np.testing.assert_array_equal(course.fit, [0.75, 0.4, np.nan])
    np.testing.assert_array_equal(course.hidden, [0, 1, 1])
    np.testing.assert_array_equal(course.misfit, 7.0)
    assert [course.unit_of(name) for name in ("misfit", "error")] == ["%", "px"]
