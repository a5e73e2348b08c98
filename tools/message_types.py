"""Write the types of what server and pages say to each other for the pages' type checker.

What routes take and answer, what streams say, and the figures of lessons are the only definition: pydantic models, and
dataclasses of the library. `python -m tools.message_types` writes them as TypeScript interfaces; a test fails when a
file is older than they are.
"""

from collections.abc import Iterator
from dataclasses import is_dataclass
from pathlib import Path
from typing import Any, get_args

from fastapi.routing import APIRoute, iter_route_contexts
from pydantic import BaseModel, TypeAdapter
from pydantic.json_schema import GenerateJsonSchema, JsonSchemaMode

from pftrack.teaching.lessons.figure import Figure
from pftrack_server.app import create_app
from pftrack_server.core.settings import Settings
from pftrack_server.jobs.jobs import Job
from pftrack_server.sessions.duplex import Message, Painted
from pftrack_server.sessions.session import Answer
from pftrack_server.sessions.spec import SessionSnapshot
from pftrack_server.sessions.worker.protocol import Command

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
    """Return an interface for each type that is sent, and a union of each stream's messages."""
    messages = sorted(set(_subclasses(Message)), key=lambda it: (it.__module__, it.__name__))
    routes = (each.original_route for each in iter_route_contexts(create_app(Settings()).routes))
    kinds = {it for route in routes if isinstance(route, APIRoute) for it in _kinds_of(route)}
    kinds |= {*messages, Painted, SessionSnapshot, Job}
    found = sorted(kinds, key=lambda it: (it.__module__, it.__name__))
    texts, names = _interfaces([(it, "validation" if _is_request(it) else "serialization") for it in found])
    return HEAD.format("the server's models") + "\n" + "\n".join([*texts, _commands(), *_unions(messages, names)])


def _figures() -> str:
    """Return an interface for a lesson's figure and each of its parts, and a union of all kinds of trace."""
    texts, names = _interfaces([(Figure, "serialization")])
    panel = Figure.model_json_schema(mode="serialization")["$defs"]["Panel"]
    kinds = _type(panel["properties"]["traces"]["items"], {f"#/$defs/{name}": name for name in names})
    union = f"/** What is drawn in a panel. */\nexport type Trace = {kinds};\n"
    return HEAD.format("pftrack/teaching/lessons/figure.py") + "\n" + "\n".join([*texts, union])


def _interfaces(kinds: list[tuple[type, JsonSchemaMode]]) -> tuple[list[str], set[str]]:
    """Return an interface for each type and all that it consists of, and their names."""
    asked = [(number, mode, TypeAdapter(kind)) for number, (kind, mode) in enumerate(kinds)]
    _, schema = TypeAdapter.json_schemas(asked, ref_template="{model}", schema_generator=_Told)
    names = {key: _name(key) for key in schema["$defs"]}
    texts = [
        _interface(names[key], body, names)
        for key, body in sorted(schema["$defs"].items(), key=lambda it: names[it[0]])
    ]
    return texts, set(names.values())


def _kinds_of(route: APIRoute) -> Iterator[type]:
    """Yield the models and dataclasses that a route takes and answers."""
    others = (answer.get("model") for answer in route.responses.values())
    for told in (
        route.response_model,
        *others,
        *(field.field_info.annotation for field in route.dependant.body_params),
    ):
        yield from _within(told)


def _within(annotation: Any) -> Iterator[type]:  # noqa: ANN401 - any annotation
    """Yield the models and dataclasses that an annotation is made of."""
    if isinstance(annotation, type) and (issubclass(annotation, BaseModel) or is_dataclass(annotation)):
        yield annotation
    for each in get_args(annotation):
        yield from _within(each)


def _subclasses(base: type[BaseModel]) -> Iterator[type[BaseModel]]:
    for each in base.__subclasses__():
        yield each
        yield from _subclasses(each)


def _is_request(kind: type) -> bool:
    """Tell whether it comes from a page, which may leave out what has a default."""
    config: dict[str, Any] = getattr(kind, "model_config", {})
    return config.get("extra") == "forbid"


def _name(key: str) -> str:
    """Return a model's name; those of one name in several modules are told apart by what they are about.

    What goes both ways has two names, since in a request it may leave out what has a default.
    """
    *modules, name = key.removesuffix("-Input").removesuffix("-Output").split("__")
    if not modules:
        return f"{name}Request" if key.endswith("-Input") else name
    if "lessons" in modules:
        return f"Lesson{name}"
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
    if "teaching" in message.__module__:
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
