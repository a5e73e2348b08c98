"""Faults of drawings: what no viewer can show, because a field does not hold what its primitive says.

Experiments of other packages draw, too, and types are not enforced while a program runs. One NaN, or a tuple where a
number should be, would make a whole frame unreadable for a page. So a drawing is looked through before it travels; a
primitive that has a fault is left out, and the caption says so.
"""

import math
from collections.abc import Mapping
from dataclasses import fields, replace
from numbers import Real

import numpy as np

from pftrack.core.model.drawing import Drawing, Mesh, Primitive

SHAPES: Mapping[str, tuple[int | None, ...]] = {
    "positions": (None, 3),
    "colours": (None, 3),
    "centre": (3,),
    "centres": (None, 3),
    "covariances": (None, 3, 3),
    "half_axes": (2, 2),
    "origin": (3,),
    "rotation": (3, 3),
    "vertices": (None, 3),
    "faces": (None, 3),
    "segments": (None, 2, 3),
    "position": (3,),
    "point": (3,),
    "apex": (3,),
    "relief": (None, None),
    "corners": (4, 3),
}
"""Extents of the arrays of all primitives by the field's name; None is any number."""

PICTURE = (None, None, 3)
NUMBERS = ("size", "width", "length", "opacity", "sigmas")
TEXTS = ("text", "title", "layer")
OPTIONAL = ("point", "relief")
BY_VERTEX = ("colour", "opacity")
"""What a mesh may have an array of, one row a vertex."""

ANCHORS = ("start", "middle", "end")
WHOLE_KINDS = "iu"
ARRAY_KINDS = "f" + WHOLE_KINDS + "b"
"""NumPy's letters for numbers that are real, whole, whole and not negative, and truths."""


def faults(drawing: Drawing) -> dict[str, str]:
    """Return what is wrong, a clause each, by the name of the primitive; those in worlds have the world's before it."""
    items = dict(drawing.primitives)
    for each in drawing.worlds:
        items |= {f"{each.world.name}/{name}": item for name, item in each.primitives.items()}
    return {name: clause for name, item in items.items() if (clause := _fault(item))}


def without_faults(drawing: Drawing) -> Drawing:
    """Return the drawing without the primitives that have a fault, which its caption then names."""
    found = faults(drawing)
    if not found:
        return drawing
    kept = {name: item for name, item in drawing.primitives.items() if name not in found}
    worlds = tuple(
        replace(each, primitives={name: item for name, item in each.primitives.items() if not _fault(item)})
        for each in drawing.worlds
    )
    left_out = "; ".join(f"{name}: {clause}" for name, clause in found.items())
    return replace(drawing, primitives=kept, worlds=worlds, caption=f"Left out of the drawing: {left_out}")


def _fault(item: Primitive) -> str:
    """Return what is wrong with a primitive, or nothing."""
    clauses = [_fault_of_field(item, field.name) for field in fields(item)]
    return next(filter(None, clauses), _fault_of_faces(item) if isinstance(item, Mesh) else "")


def _fault_of_field(item: Primitive, name: str) -> str:
    value = getattr(item, name)
    if value is None and name in OPTIONAL:
        return ""
    if name == "image_rgb":
        holds, wanted = _is_picture(value), "(height, width, 3) bytes"
    elif name in SHAPES:
        holds, wanted = _is_array(value, SHAPES[name]), f"an array {_shape(name)}"
    elif isinstance(value, np.ndarray) and isinstance(item, Mesh) and name in BY_VERTEX:  # it has looked at the shape
        holds, wanted = value.dtype.kind in ARRAY_KINDS, "numbers"
    elif name == "colour":
        holds, wanted = _is_colour(value), "three numbers from 0 to 255"
    elif name in NUMBERS:
        holds, wanted = _is_number(value), "a finite number that is not negative"
    elif name == "anchor":
        holds, wanted = isinstance(value, str) and value in ANCHORS, "start, middle or end"
    else:
        holds, wanted = name not in TEXTS or isinstance(value, str), "a text"
    return "" if holds else f"{name} must be {wanted}, got {_format_value(value)}"


def _fault_of_faces(mesh: Mesh) -> str:
    """Return what is wrong with the faces of a mesh whose arrays have their shapes, or nothing."""
    count = len(mesh.vertices)
    if mesh.faces.dtype.kind not in WHOLE_KINDS:
        return f"faces must hold whole numbers, got {mesh.faces.dtype}"
    if mesh.faces.size and not 0 <= mesh.faces.min() <= mesh.faces.max() < count:
        return f"faces must name vertices 0 to {count - 1}, got {mesh.faces.min()} to {mesh.faces.max()}"
    return ""


def _is_array(value: object, shape: tuple[int | None, ...]) -> bool:
    return (
        isinstance(value, np.ndarray)
        and value.dtype.kind in ARRAY_KINDS
        and value.ndim == len(shape)
        and all(wanted in {None, extent} for wanted, extent in zip(shape, value.shape, strict=True))
    )


def _is_picture(value: object) -> bool:
    return _is_array(value, PICTURE) and isinstance(value, np.ndarray) and value.dtype == np.uint8 and value.size > 0


def _is_colour(value: object) -> bool:
    return isinstance(value, tuple | list) and len(value) == 3 and all(_is_number(one, 255.0) for one in value)


def _is_number(value: object, most: float = math.inf) -> bool:
    return isinstance(value, Real) and 0.0 <= float(value) <= most and math.isfinite(value)


def _shape(name: str) -> str:
    extents = ("n" if extent is None else str(extent) for extent in SHAPES[name])
    return f"({', '.join(extents)})"


def _format_value(value: object) -> str:
    if isinstance(value, np.ndarray):
        return f"one of {value.dtype} {value.shape}"
    text = repr(value)
    return text if len(text) <= 40 else f"{text[:37]}..."
