"""A stored session has one description, and a snapshot of each branch's run in place of its parts."""

import json
from typing import Any

import sqlalchemy as sa
from alembic import op

revision = "0004"
down_revision = "0003"
branch_labels = None
depends_on = None

SESSIONS = sa.table("sessions", sa.column("id"), sa.column("spec"))


def upgrade() -> None:
    """Write every session anew; what cannot be read is left as it is, and left out by whoever opens it."""
    connection = op.get_bind()
    for name, text in connection.execute(sa.select(SESSIONS.c.id, SESSIONS.c.spec)).all():
        try:
            spec = _with_snapshots(json.loads(text))
        except (AttributeError, LookupError, TypeError, ValueError):
            continue
        connection.execute(sa.update(SESSIONS).where(SESSIONS.c.id == name).values(spec=json.dumps(spec)))


def downgrade() -> None:
    """Change nothing: what a session of the earlier form would lack, its worker tells again."""


def _with_snapshots(spec: dict[str, Any]) -> dict[str, Any]:
    card, values, speed, second = (spec.pop(name) for name in ("card", "values", "speed", "second"))
    card["trackers"] = [{"id": name, "title": title} for name, title in card["trackers"].items()]
    branches = {}
    for name, branch in spec["branches"].items():
        is_active = name == spec["branch"]
        goal = branch["goal"]
        run = {
            **{field: branch[field] for field in ("recipe", "tracker", "position", "computed")},
            "branch": name,
            "second": second if is_active else None,
            "parameters": values if is_active else branch["first_values"],
            "goal": None if goal is None else max(goal),
            "goal_position": None if goal is None else goal[1],
            "speed": speed,
        }
        branches[name] = {**{field: branch[field] for field in ("title", "parent", "frame")}, "run": run}
    return {**spec, "description": card, "branches": branches}
