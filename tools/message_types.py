"""Write the types of what server and pages say to each other for the pages' type checker.

The pydantic models of the server, and those of the figures of lessons, are the only definition. `python -m
tools.message_types` writes them as TypeScript interfaces; a test fails when a file is older than the models.
"""

import importlib
import pkgutil
from collections.abc import Iterator
from pathlib import Path
from typing import Any, get_args

from pydantic import BaseModel
from pydantic.json_schema import GenerateJsonSchema, JsonSchemaMode, models_json_schema

from pftrack.teaching.lessons.figure import Figure
from pftrack_server import schemas
from pftrack_server.sessions.session import Answer
from pftrack_server.sessions.worker import commands
from pftrack_server.sessions.worker.commands import Command

__all__ = ["files"]

PAGES = Path(__file__).parents[1] / "frontend_static"
HEAD = "// Generated from {} by `python -m tools.message_types`; changes here are lost.\n"
SCALARS = {"string": "string", "integer": "number", "number": "number", "boolean": "boolean", "null": "null"}

STREAMS = {"Session": "a session's", "Sweep": "a sweep's", "Follow": "a follower's", "Owned": "a lecturer's"}
"""Whose stream it is, by the beginning of its union's name."""

Schema = dict[str, Any]


class _Told(GenerateJsonSchema):
    """What the server sends has all its fields, also those with a default."""

    def field_is_required(self, field: Any, total: bool) -> bool:  # noqa: ANN401 - pydantic's own kinds of fields
        """Tell whether a field is always there."""
        return self.mode == "serialization" or super().field_is_required(field, total)


def files() -> dict[Path, str]:
    """Return the text of each generated file."""
    return {PAGES / "shared" / "messages.d.ts": _messages(), PAGES / "shared" / "figure" / "types.d.ts": _figures()}


def _messages() -> str:
    """Return an interface for each of the server's models, and a union of each stream's messages."""
    models = sorted(_models(), key=lambda model: (model.__module__, model.__name__))
    texts, names = _interfaces([(model, "validation" if _is_request(model) else "serialization") for model in models])
    return HEAD.format("the server's models") + "\n" + "\n".join([*texts, _commands(), *_unions(models, names)])


def _figures() -> str:
    """Return an interface for a lesson's figure and each of its parts, and a union of all kinds of trace."""
    texts, names = _interfaces([(Figure, "serialization")])
    panel = Figure.model_json_schema(mode="serialization")["$defs"]["Panel"]
    kinds = _type(panel["properties"]["traces"]["items"], {f"#/$defs/{name}": name for name in names})
    union = f"/** What is drawn in a panel. */\nexport type Trace = {kinds};\n"
    return HEAD.format("pftrack/teaching/lessons/figure.py") + "\n" + "\n".join([*texts, union])


def _interfaces(models: list[tuple[type[BaseModel], JsonSchemaMode]]) -> tuple[list[str], set[str]]:
    """Return an interface for each model and all that it consists of, and their names."""
    _, schema = models_json_schema(models, ref_template="{model}", schema_generator=_Told)
    names = {key: _name(key) for key in schema["$defs"]}
    texts = [
        _interface(names[key], body, names)
        for key, body in sorted(schema["$defs"].items(), key=lambda it: names[it[0]])
    ]
    return texts, set(names.values())


def _models() -> Iterator[type[BaseModel]]:
    modules = (it.name for it in pkgutil.iter_modules(schemas.__path__, f"{schemas.__name__}."))
    for module in (*modules, commands.__name__):
        for value in vars(importlib.import_module(module)).values():
            if isinstance(value, type) and issubclass(value, BaseModel) and value.__module__ == module:
                is_base = value.__name__ in {"Message", "RequestBody", "RunCommand"}
                is_base |= value.__pydantic_generic_metadata__["origin"] is not None
                yield from [] if is_base else [value]


def _is_request(model: type[BaseModel]) -> bool:
    """Tell whether it comes from a page, which may leave out what has a default."""
    return model.model_config.get("extra") == "forbid"


def _name(key: str) -> str:
    """Return a model's name; those of one name in several modules are told apart by what they are about.

    What goes both ways has two names, since in a request it may leave out what has a default.
    """
    *modules, name = key.removesuffix("-Input").removesuffix("-Output").split("__")
    if not modules:
        return f"{name}Request" if key.endswith("-Input") else name
    return ("Sweep" if "sweep" in modules[-1] else "Session") + name


def _commands() -> str:
    """Return the union of the commands, and what they are answered with."""
    members = " | ".join(each.__name__ for each in get_args(get_args(Command)[0]))
    answers = " | ".join(each.__name__ for each in get_args(Answer))
    union = f"/** What a page can ask of a session's run. */\nexport type Command = {members};\n"
    return f"{union}\n/** What a command is answered with. */\nexport type CommandAnswer = {answers};\n"


def _unions(models: list[type[BaseModel]], known: set[str]) -> Iterator[str]:
    """Yield the union of the messages of each kind of stream."""
    messages = [it for it in models if {"version", "type"} <= set(it.model_fields) and not _is_request(it)]
    for about, whose in STREAMS.items():
        names = [it.__name__ for it in messages if _stream(it) == about]
        members = [about + name if about + name in known else name for name in names]
        yield f"/** What {whose} stream says. */\nexport type {about}Message = {' | '.join(members)};\n"


def _stream(message: type[BaseModel]) -> str:
    """Return the kind of stream that a message belongs to."""
    if "follows" in message.__module__:
        return "Owned" if message.__name__.startswith("Owned") else "Follow"
    return "Sweep" if "sweep" in message.__module__ else "Session"


def _interface(name: str, schema: Schema, names: dict[str, str]) -> str:
    comment = _comment(schema, "")
    if "properties" not in schema:
        return f"{comment}export type {name} = {_type(schema, names)};\n"
    # By its kind a body is told from others, so a page never leaves it out.
    required = {*schema.get("required", ()), "kind"}
    lines = [
        f"{_comment(body, '  ')}  {field}{'' if field in required else '?'}: {_type(body, names)};\n"
        for field, body in schema["properties"].items()
    ]
    return f"{comment}export interface {name} {{\n{''.join(lines)}}}\n"


def _comment(schema: Schema, indent: str) -> str:
    text = schema.get("description", "").split("\n\n")[0].replace("\n", " ").strip()
    return f"{indent}/** {text} */\n" if text else ""


def _type(schema: Schema, names: dict[str, str]) -> str:
    """Return the TypeScript for a JSON schema."""
    if "$ref" in schema or "partial" in schema:
        return names[schema["$ref"]] if "$ref" in schema else f"Partial<{schema['partial']}>"
    if values := schema.get("enum", [schema["const"]] if "const" in schema else None):
        return " | ".join(f'"{value}"' if isinstance(value, str) else str(value).lower() for value in values)
    kind = schema.get("type")
    kinds = [{**schema, "type": each} for each in kind] if isinstance(kind, list) else None
    if options := schema.get("anyOf", schema.get("oneOf", kinds)):
        return " | ".join(dict.fromkeys(_type(option, names) for option in options))
    if kind == "array":
        return _array(schema, names)
    if kind == "object":
        values = schema.get("additionalProperties", True)
        return f"Record<string, {_type(values, names) if isinstance(values, dict) else 'unknown'}>"
    return SCALARS.get(str(kind), "unknown")


def _array(schema: Schema, names: dict[str, str]) -> str:
    if "prefixItems" in schema:
        return f"[{', '.join(_type(item, names) for item in schema['prefixItems'])}]"
    item = _type(schema.get("items", {}), names)
    return f"({item})[]" if " " in item and not item.startswith("Record") else f"{item}[]"


if __name__ == "__main__":
    for path, text in files().items():
        path.write_text(text, encoding="utf-8")
