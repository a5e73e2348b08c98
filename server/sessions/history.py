"""History: the diagnostics of every frame of a branch, in columns, as plots want them."""

from typing import Any

__all__ = ["History"]


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
