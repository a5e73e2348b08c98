"""A recording of a scene as few bytes that a browser unpacks by itself.

What repeats is written once: a column of an array, a node's state, a line of a drawing. Places are rounded to a 16th of
a pixel of the picture, which nobody sees. Whole numbers are written as steps from one to the next where these are
smaller. The bytes of a column are put in order by their weight, so that gzip finds what they have in common.
"""

import gzip
import hashlib
import json
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pftrack_server.viewer.standalone.lines import Lines
from pftrack_server.viewer.viser_adapter import Moment, NodeState

STEPS_PER_PX = 16.0
FURTHEST_PX = 1e6
"""Nothing is further away than this, so that a rounded place is a whole number of 32 bits."""
NOWHERE = -(2**31)
"""Stands for a place that is not finite."""
PLACES = frozenset({"points", "vertices", "batched_positions"})
COLUMNS = {
    **dict.fromkeys((*PLACES, "colors", "batched_colors", "batched_scales", "faces"), 3),
    "batched_wxyzs": 4,
}
"""Numbers that belong together, by the name of viser's property."""


@dataclass
class Packing:
    """Takes moments of a scene, one after the other.

    Attributes:
        pictures: JPEG files, in the order in which they came.
    """

    pictures: list[bytes] = field(default_factory=list)
    _nodes: list[dict[str, Any]] = field(default_factory=list)
    _states: list[list[Any]] = field(default_factory=list)
    _columns: list[list[Any]] = field(default_factory=list)
    _blob: bytearray = field(default_factory=bytearray)
    _lines: dict[str, Lines] = field(default_factory=dict)
    _known: dict[bytes, int] = field(default_factory=dict)

    def moment(self, nodes: Moment, layers: dict[str, str]) -> list[int]:
        """Return a moment as the numbers of its nodes' states.

        Args:
            nodes: What is shown, and what is hidden on purpose.
            layers: By name of the node.
        """
        return [self._state(name, node, layers.get(name, "")) for name, node in nodes.items()]

    @property
    def layers(self) -> set[str]:
        """Names of the layers that any node is on."""
        return {node["layer"] for node in self._nodes}

    def pack(self, moments: list[list[list[int]]]) -> bytes:
        """Return all but the pictures, packed by gzip: the length of a description, the description, and columns.

        Args:
            moments: What `moment` has returned, of the scene as it is flat and as it is raised, frame by frame.
        """
        lines = {name: [self._column(column) for column in known.table.T] for name, known in self._lines.items()}
        description = {
            "nodes": self._nodes,
            "states": self._states,
            "lines": lines,
            "columns": self._columns,
            "moments": moments,
        }
        text = json.dumps(description, separators=(",", ":"), allow_nan=False).encode()
        return gzip.compress(len(text).to_bytes(4, "little") + text + bytes(self._blob), 6, mtime=0)

    def _state(self, name: str, node: NodeState, layer: str) -> int:
        props = {key: self._value(name, node.kind, key, value) for key, value in node.props.items()}
        index, first = self._node({"name": name, "kind": node.kind, "made": node.made, "layer": layer}, props)
        changed = {key: value for key, value in props.items() if first.get(key) != value}
        value = [index, list(node.position), list(node.wxyz), int(node.visible), changed]
        return self._once(self._states, b"state" + json.dumps(value).encode(), value)

    def _node(self, made: dict[str, Any], props: dict[str, Any]) -> tuple[int, dict[str, Any]]:
        node = {"name": made["name"], "type": made["kind"], "layer": made["layer"], "props": props}
        index = self._once(self._nodes, b"node" + json.dumps(made).encode(), node)
        return index, self._nodes[index]["props"]

    def _value(self, node: str, kind: str, name: str, value: Any) -> Any:  # noqa: ANN401 - JSON or an array
        if not isinstance(value, np.ndarray):
            return value
        if name == "_data":
            file = value.tobytes()
            return {"picture": self._once(self.pictures, b"picture" + hashlib.sha256(file).digest(), file)}
        table = _steps(value) if name in PLACES else value
        if kind == "LineSegmentsMessage" and name == "points":
            return {"lines": node, "which": self._column(self._lines.setdefault(node, Lines()).add(table))}
        table = table.reshape(-1, COLUMNS.get(name, 1))
        form = "places" if name in PLACES else value.dtype.str.lstrip("<|")
        return {"array": form, "columns": [self._column(column) for column in table.T]}

    def _column(self, column: NDArray[Any]) -> int:
        data = np.ascontiguousarray(column)
        key = b"column" + data.dtype.str.encode() + hashlib.sha256(data.tobytes()).digest()
        if key not in self._known:
            form, kept = _smaller(data)
            place = [form, len(kept), len(self._blob)]
            self._blob += kept.view(np.uint8).reshape(len(kept), kept.itemsize).T.tobytes()
            self._once(self._columns, key, place)
        return self._known[key]

    def _once(self, values: list[Any], key: bytes, value: Any) -> int:  # noqa: ANN401 - whatever is kept
        if key not in self._known:
            self._known[key] = len(values)
            values.append(value)
        return self._known[key]


def _smaller(column: NDArray[Any]) -> tuple[str, NDArray[Any]]:
    """Return a column and its form, "steps" if it is written as such."""
    if column.dtype == np.int32:
        steps = np.diff(column, prepend=np.int32(0))
        if _bits(steps) < _bits(column - np.median(column) if len(column) else column):
            return "steps", steps
    return column.dtype.str.lstrip("<|"), column


def _bits(numbers: NDArray[Any]) -> float:
    return float(np.log2(1.0 + np.abs(numbers.astype(np.float64))).sum())


def _steps(places: NDArray[np.float32]) -> NDArray[np.int32]:
    """Return places as whole numbers of a 16th of a pixel."""
    known = np.isfinite(places)
    within = np.clip(np.where(known, places, 0.0).astype(np.float64), -FURTHEST_PX, FURTHEST_PX)
    return np.where(known, np.rint(STEPS_PER_PX * within), NOWHERE).astype("<i4")
