"""No room outside an experiment's own knows its name, its parameters' names, or what it tracks."""

import ast
import re
import tomllib
from collections.abc import Iterator
from pathlib import Path

from pftrack.core.model.parameters import declarations
from pftrack.experiments import EXPERIMENTS
from pftrack.experiments.ball.experiment import RecordedBallParameters
from pftrack.experiments.head.recording import RecordedHeadParameters
from pftrack.experiments.histogram.experiment import RecordedHistogramParameters
from pftrack.experiments.linkage.experiment import RecordedLinkageParameters

ROOT = Path(__file__).parents[1]

HOMES = {
    "pftrack/experiments/": "the experiments themselves, a folder each",
    "pftrack/teaching/lessons/course/": "lessons that show where in an experiment their idea is used",
    "pftrack/reproduce/": "the published results of single experiments",
}
"""Rooms in which names and words of an experiment may stand, and why."""

HOMONYMS = {
    "learned": "what was learned, of any filter, and what guidance calls its file",
    "speed": "how fast a session plays, too",
    "frame_rate_hz": "every sequence of pictures has one",
    "dimension": "how many numbers a state has",
    "motion": "how a camera or a feature moves, in structure from motion and in charts of poses",
    "forgetting": "how fast an estimate that is made online forgets",
    "translation": "a part of a similarity",
}
"""Names of parameters that are names of something general as well."""

PLACES = {
    ("pftrack/analysis/alternatives.py", "resampling"): "a role of parameters",
    ("pftrack/analysis/alternatives.py", "sharpness"): "a role of parameters",
    ("pftrack/analysis/fitting.py", "sharpness"): "a role of parameters",
    ("pftrack/core/model/parameters.py", "resampling"): "a role of parameters",
    ("pftrack/core/model/parameters.py", "sharpness"): "a role of parameters",
    ("pftrack/core/model/marks.py", "head"): "the front end of a body",
    ("pftrack/teaching/lessons/figure.py", "histogram"): "a kind of trace, by the field's name for it",
    ("pftrack/teaching/lessons/__init__.py", "resampling"): "the id of a lesson",
    ("pftrack/teaching/lessons/traces.py", "histogram"): "the same kind of trace",
    ("pftrack/core/model/faults.py", "faces"): "the triangles of a mesh",
    ("pftrack/sources/beliefs/recorder.py", "recorded"): "what a loop has recorded",
    ("pftrack/vision/structure/growing.py", "frozen"): "what a growing shape keeps",
    ("pftrack/filters/learning/mixture_em.py", "lower_density"): "mathematics, after which a parameter is named",
    ("pftrack/filters/learning/online_em.py", "largest_spectral_radius"): "the same",
    ("pftrack/vision/model_files.py", "faces"): "the triangles of a mesh",
}
"""Single places where a name means something else."""

SIMULATED = [type(experiment.simulate().parameters) for experiment in EXPERIMENTS.values()]
MODELS = [
    *SIMULATED,
    RecordedBallParameters,
    RecordedHeadParameters,
    RecordedHistogramParameters,
    RecordedLinkageParameters,
]
PARAMETERS = {declaration.name for model in MODELS for declaration in declarations(model)} - HOMONYMS.keys()
WORDS = re.compile(r"\b(face|faces|ball|balls|prism|prisms)\b(?!-)")
JS_STRING = re.compile(r"\"(?:[^\"\\]|\\.)*\"|`(?:[^`\\]|\\.)*`")


def general(room: str, ending: str) -> list[Path]:
    """The files of a room, without the homes of experiments."""
    files = sorted((ROOT / room).rglob(f"*{ending}"))
    return [path for path in files if not str(path.relative_to(ROOT)).startswith(tuple(HOMES))]


def python_leaks(path: Path) -> Iterator[str]:
    tree = ast.parse(path.read_text(encoding="utf-8"))
    prose = {id(node.value) for node in ast.walk(tree) if isinstance(node, ast.Expr)}  # docstrings
    for node in ast.walk(tree):
        if isinstance(node, ast.Attribute) and node.attr in PARAMETERS:
            yield node.attr
        if isinstance(node, ast.Constant) and isinstance(node.value, str) and id(node) not in prose:
            if node.value in PARAMETERS or node.value in EXPERIMENTS:
                yield node.value
            yield from WORDS.findall(node.value)


def script_leaks(path: Path) -> Iterator[str]:
    text = re.sub(r"/\*.*?\*/|^\s*//.*?$", "", path.read_text(encoding="utf-8"), flags=re.DOTALL | re.MULTILINE)
    for string in JS_STRING.findall(text):
        if string[1:-1] in PARAMETERS or string[1:-1] in EXPERIMENTS:
            yield string
        yield from WORDS.findall(string)
    yield from (name for name in re.findall(r"\.([a-z_0-9]+)\b", text) if name in PARAMETERS)


def test_no_experiment_leaks_into_the_program() -> None:
    """No general module has an experiment's name, a parameter's name or what is tracked as a string or an attribute."""
    files = [(path, python_leaks) for room in ("pftrack", "server") for path in general(room, ".py")]
    files += [(path, script_leaks) for path in general("frontend_static", ".js")]
    leaks = [(str(path.relative_to(ROOT)), name) for path, search in files for name in search(path)]
    assert [leak for leak in leaks if leak not in PLACES] == []


def test_exceptions_are_needed() -> None:
    """Every home exists, every homonym is a parameter, and every single place holds what it is excused for."""
    assert [home for home in HOMES if not (ROOT / home).exists()] == []
    known = {declaration.name for model in MODELS for declaration in declarations(model)}
    assert HOMONYMS.keys() <= known
    assert [place for place in PLACES if place[1] not in python_leaks(ROOT / place[0])] == []


def test_each_family_is_behind_the_registry() -> None:
    """The contract that guards the folders of families names all of them."""
    contracts = tomllib.loads((ROOT / "pyproject.toml").read_text())["tool"]["importlinter"]["contracts"]
    guarded = next(
        contract for contract in contracts if contract["name"] == "The registry alone leads to an experiment"
    )
    folders = {path.parent.name for path in (ROOT / "pftrack" / "experiments").glob("*/__init__.py")}
    assert {name.rpartition(".")[2] for name in guarded["protected_modules"]} == folders - {"own", "shared"}


def test_a_leak_is_found(tmp_path: Path) -> None:
    """The search in scripts finds strings, attributes and words, and passes over prose; places show that of Python."""
    script = tmp_path / "leak.js"
    script.write_text('// a face\nconst a = `face ${p.gamma_px}`; /* "ball" */ if (id === "ball") a["gamma_px"] = 1;\n')
    assert sorted(script_leaks(script)) == ['"ball"', '"gamma_px"', "ball", "face", "gamma_px"]
