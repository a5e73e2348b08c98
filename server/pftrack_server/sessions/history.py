"""History: the diagnostics of every frame of a branch, in columns, as plots want them."""

from typing import Any

from pftrack.core.model.measures import judge_loss
from pftrack.runs.loss import loss_start


class History:
    """The diagnostics of one branch, a list a column, in the order of the frames.

    Attributes:
        changes: How often it has changed.
    """

    def __init__(self) -> None:
        self.columns: dict[str, list[Any]] = {}
        self.changes = 0

    def __len__(self) -> int:
        return len(self.columns.get("frame", ()))

    def put(self, rows: list[dict[str, Any]]) -> list[dict[str, Any]]:
        """Take over rows; a frame that is known already is replaced.

        Returns:
            The rows with what is told of the target: `lost_by`, who says whether it is lost, and `lost_since`, where
            the loss began that goes on there.
        """
        self.changes += 1
        return [self._put(row) for row in rows]

    def _put(self, row: dict[str, Any]) -> dict[str, Any]:
        index, since = row["frame"], self.columns.get("lost_since", [])
        before = since[index - 1] if 0 < index <= len(since) else None
        said = judge_loss(row.get("lost"), row.get("searching"))
        row = {**row, "lost_by": said.witness, "lost_since": loss_start(index, before, lost=said.lost)}
        if not self.columns:
            self.columns = {name: [] for name in row}
        if index == len(self):
            for name, column in self.columns.items():
                column.append(row[name])
        elif index < len(self):
            for name, column in self.columns.items():
                column[index] = row[name]
        return row

    def upto(self, frame: int) -> "History":
        """Return a copy of the frames up to and including one: what a branch shares with its parent."""
        copy = History()
        copy.columns = {name: column[: frame + 1] for name, column in self.columns.items()}
        return copy
