"""The reference of the REST interface at `/docs`: its OpenAPI description as one page, nothing from elsewhere."""

import html
import json
from typing import Any

from fastapi import APIRouter, Request
from starlette.responses import HTMLResponse

router = APIRouter(include_in_schema=False)

PAGE = """<!doctype html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<title>pftrack REST interface</title>
<link rel="icon" href="static/shared/icon.svg" type="image/svg+xml">
<link rel="stylesheet" href="static/shared/palette.css">
<link rel="stylesheet" href="static/shared/style.css">
<style>
main {{ max-width: 60rem; margin: 0 auto; padding: 1rem; }}
h1 {{ font-size: 1.5rem; }}
h2 {{ font-size: 1.2rem; }}
h1, h2, p {{ margin: 1rem 0; }}
summary {{ cursor: pointer; padding: .25rem 0; }}
summary code {{ font-weight: 600; }}
pre {{ overflow: auto; padding: .75rem; }}
</style>
</head>
<body>
<main>
<h1>REST interface</h1>
<p>{description}</p>
<p>The same for programs: <a href="openapi.json">openapi.json</a>.
A session's stream of messages is the websocket <code>api/v1/sessions/{{session}}/stream</code>, a sweep's is
<code>api/v1/sweeps/{{sweep}}/stream?x=&amp;y=</code>.</p>
{operations}
<h2 id="shapes">Shapes</h2>
{shapes}
</main>
</body>
</html>
"""


@router.get("/docs")
async def reference(request: Request) -> HTMLResponse:
    """Return the reference of the REST interface."""
    schema: dict[str, Any] = request.app.openapi()
    operations = "".join(
        _operation(method, path, operation)
        for path, methods in schema["paths"].items()
        for method, operation in methods.items()
    )
    shapes = "".join(
        f'<details id="{_text(name)}"><summary><code>{_text(name)}</code></summary>{_json(shape)}</details>'
        for name, shape in schema["components"]["schemas"].items()
    )
    page = PAGE.format(description=_text(schema["info"]["description"]), operations=operations, shapes=shapes)
    return HTMLResponse(page)


def _operation(method: str, path: str, operation: dict[str, Any]) -> str:
    """Return one operation: what it does, what it takes and what it gives."""
    taken = {
        "parameters": operation.get("parameters", []),
        "body": operation.get("requestBody", {}).get("content", {}),
        "answers": {status: answer.get("content", {}) for status, answer in operation["responses"].items()},
    }
    return (
        f"<details><summary><code>{method.upper()} {_text(path)}</code> {_text(operation['description'])}</summary>"
        f"{_json({name: value for name, value in taken.items() if value})}</details>"
    )


def _json(value: object) -> str:
    return f"<pre>{_text(json.dumps(value, indent=2))}</pre>"


def _text(value: str) -> str:
    return html.escape(value)
