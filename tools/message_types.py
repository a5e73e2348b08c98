"""Write the types of messages between server and pages for the pages' type checker.

Requests, answers, stream messages and the figures of lessons are defined only once, as pydantic models and dataclasses
of the library. `python -m tools.message_types` writes them as TypeScript interfaces; a test fails if a file is out of
date.
"""

import re
from collections.abc import Iterable, Iterator
from dataclasses import is_dataclass
from http import HTTPStatus
from pathlib import Path
from typing import Any, get_args

from fastapi import FastAPI
from fastapi.dependencies.models import Dependant
from fastapi.routing import APIRoute, APIWebSocketRoute, iter_route_contexts
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
API = "/api/v1/"
SCALARS = {"string": "string", "integer": "number", "number": "number", "boolean": "boolean", "null": "null"}

STREAMS = {"Session": "a session's", "Sweep": "a sweep's", "Follow": "a follower's", "Owned": "a lecturer's"}
"""Owner of a stream, by the prefix of its union's name."""

Schema = dict[str, Any]


class _Told(GenerateJsonSchema):
    """Schema of the server's messages, which have all fields, even those with a default."""

    def field_is_required(self, field: Any, total: bool) -> bool:  # noqa: ANN401 - pydantic's own kinds of fields
        """Return whether a field is always present."""
        return self.mode == "serialization" or super().field_is_required(field, total)


def files() -> dict[Path, str]:
    """Return the text of each generated file."""
    return {PAGES / "shared" / "messages.d.ts": _messages(), PAGES / "shared" / "figure" / "types.d.ts": _figures()}


def _messages() -> str:
    """Return an interface for each sent type, one for all requests, and a union of each stream's messages."""
    app = create_app(Settings())
    messages = sorted(set(_subclasses(Message)), key=lambda it: (it.__module__, it.__name__))
    routes = {
        (method, str(each.path)): each.original_route
        for each in iter_route_contexts(app.routes)
        if isinstance(each.original_route, APIRoute) and str(each.path).startswith(API)
        for method in each.original_route.methods or ()
    }
    kinds = {it for route in routes.values() for it in _kinds_of(route)}
    found = sorted({*kinds, *messages, Painted, SessionSnapshot, Job}, key=lambda it: (it.__module__, it.__name__))
    asked: list[tuple[Any, JsonSchemaMode]]
    asked = [(kind, "validation" if _is_request(kind) else "serialization") for kind in found]
    for route in routes.values():
        answer = _answer(route)
        asked += [(_body(route), "validation"), (answer, "validation" if _is_request(answer) else "serialization")]
    texts, names, types = _interfaces(asked)
    sent = zip(routes, types[len(found) :: 2], types[len(found) + 1 :: 2], strict=True)
    requests = _requests(app.openapi()["paths"], sent, [*_streams(app)])
    head = HEAD.format("the server's models") + "\n"
    return head + "\n".join([*texts, requests, _commands(), *_unions(messages, set(names))])


def _figures() -> str:
    """Return an interface for a lesson's figure and each of its parts, and a union of all kinds of trace."""
    texts, names, _ = _interfaces([(Figure, "serialization")])
    panel = Figure.model_json_schema(mode="serialization")["$defs"]["Panel"]
    kinds = _type(panel["properties"]["traces"]["items"], {f"#/$defs/{name}": name for name in names})
    union = f"/** A trace of a panel. */\nexport type Trace = {kinds};\n"
    return HEAD.format("pftrack/teaching/lessons/figure.py") + "\n" + "\n".join([*texts, union])


def _interfaces(kinds: list[tuple[Any, JsonSchemaMode]]) -> tuple[list[str], list[str], list[str]]:
    """Return interfaces for some types and their parts, the names of these, and the TypeScript of each type."""
    asked = [(number, mode, TypeAdapter(kind)) for number, (kind, mode) in enumerate(kinds)]
    found, schema = TypeAdapter.json_schemas(asked, ref_template="{model}", schema_generator=_Told)
    names = {key: _name(key) for key in schema["$defs"]}
    texts = [
        _interface(names[key], body, names)
        for key, body in sorted(schema["$defs"].items(), key=lambda it: names[it[0]])
    ]
    return texts, [*names.values()], [_type(found[number, mode], names) for number, mode, _ in asked]


def _body(route: APIRoute) -> Any:  # noqa: ANN401 - any annotation
    """Return the type of a route's body; None if it has none, or takes a file."""
    return next((field.field_info.annotation for field in route.dependant.body_params), None)


def _answer(route: APIRoute) -> Any:  # noqa: ANN401 - any annotation
    """Return the type of a route's answer: text if it is not JSON, None if it is empty."""
    told = route.responses.get(HTTPStatus.OK)
    return route.response_model or (None if told is None else told.get("model", str))


def _requests(paths: Schema, sent: Iterable[tuple[tuple[str, str], str, str]], streams: Iterable[str]) -> str:
    """Return the interface of all requests: address, body and answer."""
    lines = []
    for (method, path), body, answer in sent:
        operation = paths[path][method.lower()]
        asked = [_asked(each) for each in operation.get("parameters", ())]
        if body != "null":
            asked.append(f"body{'' if operation['requestBody'].get('required') else '?'}: {body}")
        elif kinds := operation.get("requestBody", {}).get("content"):
            asked.append("body?: FormData" if "multipart/form-data" in kinds else "body: Blob")
        lines.append(_request(method, path, asked, answer))
    lines += streams
    comment = "/** Each request's parameters and body, and its answer. */\n"
    return f"{comment}export interface Requests {{\n{''.join(lines)}}}\n"


def _streams(app: FastAPI) -> Iterator[str]:
    """Yield the line of each websocket, with its query."""
    for each in iter_route_contexts(app.routes):
        if isinstance(each.original_route, APIWebSocketRoute) and str(each.path).startswith(API):
            path = str(each.path)
            asked = [f"{name}: string" for name in re.findall(r"{(\w+)}", path)]
            query = [f"{name}?: {_in_address(kind)}" for name, kind in _query_of(each.original_route.dependant)]
            yield _request("WS", path, asked + query, "null")


def _query_of(dependant: Dependant) -> Iterator[tuple[str, Schema]]:
    """Yield the query parameters of a route with their schemas, those of its dependencies included."""
    for field in dependant.query_params:
        annotation: Any = field.field_info.annotation
        yield field.alias, TypeAdapter(annotation).json_schema()
    for each in dependant.dependencies:
        yield from _query_of(each)


def _request(method: str, path: str, asked: list[str], answer: str) -> str:
    """Return the line of a request."""
    inner = f"{{ {'; '.join(asked)} }}" if asked else "{}"
    return f'  "{method} {path.removeprefix(API)}": {{ asked: {inner}; answer: {answer} }};\n'


def _asked(parameter: Schema) -> str:
    """Return the field of a part of an address."""
    return f"{parameter['name']}{'' if parameter['required'] else '?'}: {_in_address(parameter['schema'])}"


def _in_address(schema: Schema) -> str:
    """Return the TypeScript of a part of an address, which is text for any type."""
    words = re.sub(r'"[^"]*"( \| "[^"]*")*', "string", _type(schema, {}))
    return words.replace("number", "number | string")


def _kinds_of(route: APIRoute) -> Iterator[type]:
    """Yield the models and dataclasses of a route's requests and answers."""
    others = (answer.get("model") for answer in route.responses.values())
    for told in (
        route.response_model,
        *others,
        *(field.field_info.annotation for field in route.dependant.body_params),
    ):
        yield from _within(told)


def _within(annotation: Any) -> Iterator[type]:  # noqa: ANN401 - any annotation
    """Yield the models and dataclasses in an annotation."""
    if isinstance(annotation, type) and (issubclass(annotation, BaseModel) or is_dataclass(annotation)):
        yield annotation
    for each in get_args(annotation):
        yield from _within(each)


def _subclasses(base: type[BaseModel]) -> Iterator[type[BaseModel]]:
    for each in base.__subclasses__():
        yield each
        yield from _subclasses(each)


def _is_request(kind: type) -> bool:
    """Return whether a type comes from a page, which may omit fields with a default."""
    config: dict[str, Any] = getattr(kind, "model_config", {})
    return config.get("extra") == "forbid"


def _name(key: str) -> str:
    """Return a model's name; equal names in several modules get their subject as a prefix.

    A type that is sent both ways has two names, since a request may omit fields with a default.
    """
    *modules, name = key.removesuffix("-Input").removesuffix("-Output").split("__")
    if not modules:
        return f"{name}Request" if key.endswith("-Input") else name
    if "lessons" in modules:
        return f"Lesson{name}"
    return ("Sweep" if "sweep" in modules[-1] else "Session") + name


def _commands() -> str:
    """Return the union of the commands, and that of their answers."""
    members = " | ".join(each.__name__ for each in get_args(get_args(Command)[0]))
    answers = " | ".join(each.__name__ for each in get_args(Answer))
    union = f"/** A page's command to a session's run. */\nexport type Command = {members};\n"
    return f"{union}\n/** The answer to a command. */\nexport type CommandAnswer = {answers};\n"


def _unions(models: list[type[BaseModel]], known: set[str]) -> Iterator[str]:
    """Yield the union of the messages of each kind of stream."""
    messages = [it for it in models if {"version", "type"} <= set(it.model_fields) and not _is_request(it)]
    for about, whose in STREAMS.items():
        names = [it.__name__ for it in messages if _stream(it) == about]
        members = [about + name if about + name in known else name for name in names]
        yield f"/** A message of {whose} stream. */\nexport type {about}Message = {' | '.join(members)};\n"


def _stream(message: type[BaseModel]) -> str:
    """Return the kind of stream that a message belongs to."""
    if "teaching" in message.__module__:
        return "Owned" if message.__name__.startswith("Owned") else "Follow"
    return "Sweep" if "sweep" in message.__module__ else "Session"


def _interface(name: str, schema: Schema, names: dict[str, str]) -> str:
    comment = _comment(schema, "")
    if "properties" not in schema:
        return f"{comment}export type {name} = {_type(schema, names)};\n"
    # `kind` tells bodies apart, so a page never omits it.
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
