"""What is promised of versions 1, as data; `python -m tests.promises` prints it.

`tests/data/promises.json` holds what this printed. Whatever it names stays until version 2; what comes in addition is
added to it by printing it anew, which is told in the changelog:

    python -m tests.promises > tests/data/promises.json
"""

import io
import json
import sys
from collections.abc import Mapping
from contextlib import redirect_stdout, suppress
from typing import Any

from pftrack.cli import app as cli
from pftrack.cli import output
from pftrack.core.model.recipe import Recipe
from pftrack.experiments import EXPERIMENTS
from pftrack.experiments.experiment import INTERFACE
from pftrack.runs.table import columns_in
from tests.making import whole_run
from tools.site import command_line
from tools.site.rest import description

WORDS = {"title", "description", "default", "examples"}
"""The parts of a schema that explain it and may change."""


def promises() -> dict[str, Any]:
    """Return all of it, in a form of dictionaries and sorted lists in which nothing may be missing later."""
    return {
        "interface of experiments": INTERFACE,
        "exit statuses": {"failed": output.FAILED, "wrong use": output.WRONG_USE},
        "commands": {
            name.removeprefix("pftrack "): sorted({each for it in command.params for each in it.opts or [it.name]})
            for name, command in command_line.commands()
            if not hasattr(command, "commands")
        },
        "json": {line: keys_of(json.loads(answer(*line.split()))) for line in LINES},
        "recipe": {name: json.dumps(bare(it)) for name, it in Recipe.model_json_schema()["properties"].items()},
        "columns": {name: columns(name) for name in EXPERIMENTS.own},
        **rest(),
    }


LINES = (
    "list --json",
    "show ball --json",
    "run ball --frames 2 --json",
    "failures list --json",
    "lessons list --json",
    "exercise list --json",
)
"""Commands whose JSON is looked at."""


def answer(*arguments: str) -> str:
    """Return what a command prints."""
    told = io.StringIO()
    with redirect_stdout(told), suppress(SystemExit):
        cli.main(list(arguments))
    return told.getvalue()


def keys_of(value: Any) -> Any:
    """Return the names in a JSON value: of the first of a list."""
    if isinstance(value, list):
        return [keys_of(value[0])] if value else []
    return dict.fromkeys(sorted(value)) if isinstance(value, Mapping) else None


def columns(name: str) -> list[str]:
    """Return the columns of an experiment's exported tables, by its default tracker."""
    experiment = EXPERIMENTS[name]
    run = whole_run(experiment, frames=2)
    return [column.name for column in columns_in(run)]


def rest() -> dict[str, Any]:
    """Return what REST takes and gives: operations, and the fields of what they speak of."""
    schema = description()
    operations = {
        f"{method.upper()} {path}": {
            "parameters": sorted(f"{it['in']} {it['name']}" for it in operation.get("parameters", ())),
            "answers": sorted(status for status in operation["responses"] if status.startswith("2")),
        }
        for path, methods in schema["paths"].items()
        if path.startswith("/api/v1/")
        for method, operation in methods.items()
    }
    schemas = {
        name: {field: json.dumps(bare(declared)) for field, declared in sorted(found["properties"].items())}
        for name, found in sorted(schema["components"]["schemas"].items())
        if "properties" in found
    }
    needed = {name: sorted(schema["components"]["schemas"][name].get("required", [])) for name in schemas}
    return {"operations": operations, "schemas": schemas, "required": needed}


def bare(schema: Any) -> Any:
    """Return a schema without its words."""
    if isinstance(schema, Mapping):
        return {key: bare(value) for key, value in sorted(schema.items()) if key not in WORDS}
    return [bare(each) for each in schema] if isinstance(schema, list) else schema


if __name__ == "__main__":
    sys.stdout.write(f"{json.dumps(promises(), indent=1, sort_keys=True)}\n")
