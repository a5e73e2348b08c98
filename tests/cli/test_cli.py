"""The command line: lists, help, commands of other packages, and the commands that check an installation."""

import json
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from typer.main import get_command

from pftrack import __version__
from pftrack.cli.app import app
from pftrack.experiments import EXPERIMENTS, find
from tests.cli.commands import Ask, Call, refused


def test_list_names_every_experiment(call: Call, ask: Ask) -> None:
    """`list` prints each experiment, and with `--json` one list of them with trackers and presets."""
    code, out, _ = call("list")
    assert (code, [name for name in EXPERIMENTS if name not in out]) == (0, [])
    listed = ask("list")
    assert [entry["id"] for entry in listed] == list(EXPERIMENTS)
    assert listed[0]["trackers"][0].keys() == {"id", "title", "description"}


def test_a_shell_completes_commands(call: Call, monkeypatch: pytest.MonkeyPatch) -> None:
    """As `--show-completion` sets it up."""
    for name, value in (("_PFTRACK_COMPLETE", "complete_bash"), ("COMP_WORDS", "pftrack show-"), ("COMP_CWORD", "1")):
        monkeypatch.setenv(name, value)
    assert call()[1].split() == ["show-recipe"]


def helps(command: Any) -> Iterator[str]:
    """Yield the help of every option and argument of the library's own commands."""
    for parameter in command.params:
        yield parameter.help or ""
    for inner in getattr(command, "commands", {}).values():
        yield from helps(inner)


def test_helps_say_what_an_option_is() -> None:
    """Each is a sentence, and none begins with a word that depends on its neighbours."""
    said = list(helps(get_command(app)))
    assert len(said) > 100
    assert [text for text in said if text.startswith(("Of ", "What ", "Where ", "Whose "))] == []
    assert [text for text in said if not text[:1].strip() or not text.endswith(".")] == []


def test_show_describes_an_experiment(call: Call, ask: Ask) -> None:
    """`show` prints parameters, presets with what to look at, and its source; `--json` gives all that is declared."""
    shown, table = ask("show", "ball"), call("show", "ball")[1]
    for declaration in shown["declarations"]:
        assert declaration["name"] in table
        assert declaration["title"]
        assert declaration["description"]
        assert {"unit", "default", "minimum", "maximum", "step", "choices", "live"} <= declaration.keys()
    presets = find("ball").presets
    assert [preset.name for preset in presets if preset.name not in table] == []
    assert "what to look at" in table
    assert [each["watch"] for each in shown["presets"]] == [preset.watch for preset in presets]
    assert "Takashi Bando: Adaptive Sampling Method" in table
    assert shown["references"][0]["key"] == "bando2007"


def test_help_lists_the_commands_of_other_packages_too(call: Call) -> None:
    """`--help` shows the library's commands and `serve`, which comes from the server by an entry point."""
    code, out, _ = call("--help")
    commands = ("serve", "list", "show", "run", "replay", "reproduce", "bench", "doctor")
    assert (code, [command for command in commands if command not in out]) == (0, [])
    assert "--port" in call("serve", "--help")[1]
    assert call("--version")[:2] == (0, f"pftrack {__version__}\n")


def test_a_command_that_cannot_be_loaded_does_not_hide_the_others(call: Call, monkeypatch: pytest.MonkeyPatch) -> None:
    """With a broken server the library's commands still work, and `serve` says why it does not."""
    monkeypatch.setitem(sys.modules, "pftrack_server.command", None)
    assert (call("--help")[0], call("list")[0]) == (0, 0)
    refused(call("serve"), 1, "the command serve cannot be loaded")


@pytest.mark.parametrize(("ours", "verdict", "code"), [(1.95, "reproduced", 0), (1.0, "differs", 1)])
def test_reproduce_sets_ours_beside_the_reference(
    call: Call, monkeypatch: pytest.MonkeyPatch, ours: float, verdict: str, code: int
) -> None:
    """`reproduce --json` gives a list of findings, otherwise a table; a difference ends with status 1."""
    from pftrack.reproduce.finding import GROUNDS, Statement

    stated = Statement(result="mean", source="made up", reference=2.0, tolerance=0.1, ground="stated")
    monkeypatch.setattr("pftrack.reproduce.signals.one_step", lambda _pool, _full: [stated.judge(ours)])
    ended, out, err = call("reproduce", "one-step", "--json")
    first, *others = json.loads(out)
    expected = {"result": "mean", "ours": ours, "reference": 2.0, "tolerance": 0.1, "source": "made up", "reason": ""}
    expected |= {"ground": GROUNDS["stated"], "timed": False, "explained": False}
    assert (ended, first) == (code, expected | {"verdict": verdict, "known": False})
    assert {other["verdict"] for other in others} == {"not run"}
    assert err.startswith(f"pftrack: 1 {verdict}, ")
    assert err.endswith(f"; differences: 0 with a known cause, 0 without, {code} not expected\n")
    shown = call("reproduce", "one-step")[1]
    assert ["mean", *f"{ours:g} 2 ± 0.1 {verdict}".split()] == shown.splitlines()[1].split()
    assert max(map(len, shown.splitlines())) <= 80


def test_doctor_fails_on_what_is_broken(call: Call, ask: Ask, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Nothing required is broken on this machine.

    An impossible data folder gives status 1 and a line that names the check; without `--json` there is a table.
    """
    monkeypatch.setattr("pftrack.doctor.checks._compilation", lambda *, everything: ("ok", f"{everything}"))
    report = ask("doctor")
    assert report["healthy"], report
    assert {check["status"] for check in report["checks"]} <= {"ok", "warning"}
    (tmp_path / "file").touch()
    code, out, err = call("doctor", "--data-dir", tmp_path / "file" / "below", "--json")
    assert (code, json.loads(out)["healthy"]) == (1, False)
    assert err == "pftrack: broken: data folder\n"
    assert "compiled code" in call("doctor")[1]


def test_bench_runs_scripts(call: Call, ask: Ask, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """`bench NAME --json` gives an object with the value of each; the installed package has none, and says so."""
    monkeypatch.setattr("pftrack.cli.checks.__file__", str(tmp_path / "pftrack" / "cli" / "checks.py"))
    refused(call("bench"), 1, "the benchmarks come with the source")
    (tmp_path / "benchmarks").mkdir()
    for name in ("one", "other"):
        (tmp_path / "benchmarks" / f"{name}.py").write_text("import json, sys\nprint(json.dumps(sys.argv[1:]))\n")
    assert ask("bench", "one", "--smallest") == {"one": ["--smallest", "--json"]}
