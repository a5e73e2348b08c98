"""The reference of the REST interface, from the server's own description (OpenAPI)."""

import tempfile
from functools import lru_cache
from typing import Any

from pftrack_server.app import create_app
from pftrack_server.core.settings import Settings

__all__ = ["description", "markdown"]

WORDS = {
    "experiments": "Experiments", "failures": "Failures", "filters": "Filters in files",
    "follows": "Classes that follow", "health": "Health", "jobs": "Jobs: exports, fits, explorations and comparisons",
    "lectures": "Lectures", "lessons": "Lessons", "sessions": "Sessions", "source code": "Source code",
    "sweeps": "Sweeps", "uploads": "Uploads", "work": "My work",
}  # fmt: skip


@lru_cache(1)
def description() -> dict[str, Any]:
    """Return the description of the app with default settings."""
    with tempfile.TemporaryDirectory() as folder:
        found: dict[str, Any] = create_app(Settings(data_dir=folder)).openapi()
    return found


def markdown() -> str:
    """Return the reference as Markdown: a section for each tag, and one for the shapes of data."""
    told = description()
    tags: dict[str, list[str]] = {}
    for path, methods in told["paths"].items():
        for method, operation in methods.items():
            (tag,) = operation["tags"]
            tags.setdefault(tag, []).append(_operation(method, path, operation))
    sections = [f"## {WORDS[tag]}\n\n" + "\n\n".join(tags[tag]) for tag in sorted(tags, key=WORDS.__getitem__)]
    shapes = [_shape(name, shape) for name, shape in sorted(told["components"]["schemas"].items())]
    return "\n\n".join([*sections, "## Shapes", *shapes])


def _operation(method: str, path: str, operation: dict[str, Any]) -> str:
    parts = [f"### `{method.upper()} {path}`", _text(operation.get("description", ""))]
    rows = [
        (f"`{each['name']}`", f"{each['in']}{', required' if each.get('required') else ''}", _type(each["schema"]),
         each.get("description", ""))
        for each in operation.get("parameters", [])
    ]  # fmt: skip
    if rows:
        parts.append(_table(("parameter", "where", "type", "meaning"), rows))
    lines = []
    for kind, content in operation.get("requestBody", {}).get("content", {}).items():
        lines.append(f"- Body: {_type(content.get('schema', {}))} as `{kind}`")
    for status, answer in operation["responses"].items():
        if status in {"4XX", "5XX", "422"}:
            continue
        shapes = [f"{_type(it.get('schema', {}))} as `{kind}`" for kind, it in answer.get("content", {}).items()]
        lines.append(f"- Answer {status}: {', or '.join(shapes) or 'nothing'}")
    return "\n\n".join([*parts, "\n".join(lines)])


def _shape(name: str, shape: dict[str, Any]) -> str:
    parts = [f"(shape-{name.lower()})=\n### {name}"]
    if text := shape.get("description"):
        parts.append(_text(text.split("\n\nAttributes:")[0]))
    needed = set(shape.get("required", []))
    rows = [
        (f"`{field}`", _type(it), "yes" if field in needed else "", it.get("description", ""))
        for field, it in shape.get("properties", {}).items()
    ]
    if rows:
        parts.append(_table(("field", "type", "required", "meaning"), rows))
    elif "enum" in shape or "const" in shape or "type" in shape or "oneOf" in shape or "anyOf" in shape:
        parts.append(_type(shape))
    return "\n\n".join(parts)


def _type(schema: dict[str, Any]) -> str:
    """Return the type of a value in words, with links to the shapes."""
    if "$ref" in schema:
        name = schema["$ref"].rpartition("/")[2]
        return f"[{name}](#shape-{name.lower()})"
    if either := next((schema[joined] for joined in ("anyOf", "oneOf", "allOf") if joined in schema), None):
        return " or ".join(dict.fromkeys(_type(each) for each in either))
    if "enum" in schema or "const" in schema:
        return ", ".join(f"`{value}`" for value in schema.get("enum", [schema.get("const")]))
    kind = str(schema.get("type", "any"))
    if kind == "array":
        kind = f"list of {_type(schema.get('items') or (schema.get('prefixItems') or [{}])[0])}"
    elif kind == "object" and isinstance(schema.get("additionalProperties"), dict):
        kind = f"object of {_type(schema['additionalProperties'])}"
    return " ".join([kind, *_bounds(schema)])


def _bounds(schema: dict[str, Any]) -> list[str]:
    low = schema.get("minimum", schema.get("exclusiveMinimum"))
    high = schema.get("maximum", schema.get("exclusiveMaximum"))
    return [f"from {low}"] * (low is not None) + [f"to {high}"] * (high is not None)


def _table(head: tuple[str, ...], rows: list[tuple[str, ...]]) -> str:
    lines = [head, ("---",) * len(head), *rows]
    return "\n".join(f"| {' | '.join(_text(cell, cell_of_table=True) for cell in line)} |" for line in lines)


def _text(text: str, *, cell_of_table: bool = False) -> str:
    """Return a docstring as Markdown; in a table on one line."""
    escaped = text.replace("<", "&lt;").replace("{", "&#123;") if not cell_of_table else text.replace("<", "&lt;")
    return " ".join(escaped.split()).replace("|", "\\|") if cell_of_table else escaped
