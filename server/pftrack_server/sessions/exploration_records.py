"""What the processes of an exploration tell, as it may be believed: they have read what came from elsewhere."""

from pydantic import BaseModel

from pftrack.analysis.counterfactuals.alternatives import Kind
from pftrack.core.model.parameters import Value


class FindingRecord(BaseModel):
    """What a process tells of one change."""

    kind: Kind
    title: str
    values: dict[str, Value]
    parameter: str
    held: dict[str, bool]
    steps: int
    seconds: float
    place: int


class WhatIfRecord(BaseModel):
    """What a process tells of its part of the changes, as `pftrack.analysis.counterfactuals.record` writes it."""

    loss: int
    begin: int
    end: int
    judged: int
    planned: int
    trials: int
    is_complete: bool
    findings: list[FindingRecord]
