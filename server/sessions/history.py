"""History: the diagnostics of every frame of every branch, in columns, as plots want them."""

import math
from typing import Any

__all__ = ["History", "finite"]


class History:
    """The diagnostics of one branch, a list a column, in the order of the frames."""

    def __init__(self) -> None:
        self.columns: dict[str, list[Any]] = {}

    def __len__(self) -> int:
        return len(self.columns.get("frame", ()))

    def put(self, rows: list[dict[str, Any]]) -> None:
        """Take over rows; a frame that is known already is replaced."""
        for row in rows:
            if not self.columns:
                self.columns = {name: [] for name in row}
            index = row["frame"]
            if index == len(self):
                for name, column in self.columns.items():
                    column.append(row[name])
            elif index < len(self):
                for name, column in self.columns.items():
                    column[index] = row[name]

    def upto(self, frame: int) -> "History":
        """Return a copy of the frames up to and including one: what a branch shares with its parent."""
        copy = History()
        copy.columns = {name: column[: frame + 1] for name, column in self.columns.items()}
        return copy


def finite(row: dict[str, Any]) -> dict[str, Any]:
    """Return a row that JSON can carry: numbers that are not finite are not known."""
    return {name: _finite(value) for name, value in row.items()}


def _finite(value: Any) -> Any:  # noqa: ANN401 - whatever a column holds
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    if isinstance(value, list | tuple):
        return [_finite(item) for item in value]
    return value
