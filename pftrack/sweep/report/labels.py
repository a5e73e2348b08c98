"""What is written in a report: names of axes, their values, and results."""

from math import isnan
from typing import Literal

from pftrack.core.model.parameters import Value
from pftrack.sweep.axis import Axis, find_declaration
from pftrack.sweep.report.study import Study

__all__ = ["format_value", "label", "number"]


def label(study: Study, axis: Axis) -> str:
    """Return what an axis is called, with its unit."""
    declaration = find_declaration(study.result.plan.wiring, axis.name, study.result.plan.kind)
    return f"{declaration.title}, {declaration.unit}" if declaration.unit else declaration.title


LONGEST_SHOWN = 60
"""Characters of a value."""


def format_value(value: Value) -> str:
    """Return a value as a tick or a table shows it."""
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, str) and len(value) > LONGEST_SHOWN:
        return "own file"  # nothing else is as long
    return f"{value:g}" if isinstance(value, float) else str(value)


def number(value: float, sign: Literal["", "+"] = "") -> str:
    """Return a result to three digits, whole from 1,000 on; nothing for NaN.

    Args:
        value: The result.
        sign: "+" to write it of positive values too.
    """
    if isnan(value):
        return ""
    return f"{value:{sign},.0f}" if abs(value) >= 999.5 else f"{value:{sign}.3g}"
