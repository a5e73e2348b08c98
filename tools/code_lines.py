"""Code lines per top folder, which may only fall.

`python -m tools.code_lines` checks them; `--lower` lowers the limits after lines were removed. A code line contains
more than blanks, comments and docstrings. `code_lines.json` next to this file has the largest number allowed for each
folder of the library, the server and the pages, and for all tests together.
"""

import ast
import json
import re
import subprocess
import sys
from collections import Counter
from pathlib import Path

ROOT = Path(__file__).parents[1]
LIMITS = Path(__file__).with_name("code_lines.json")
ROOMS = {"pftrack/": 2, "server/pftrack_server/": 3, "frontend_static/": 2, "tests/": 1}
"""Prefixes of the counted files, and the number of path parts that name the folder they count for."""


def code_lines(name: str, text: str) -> int:
    """Return the number of code lines of a Python or JavaScript file."""
    if name.endswith(".js"):
        text = re.sub(r"/\*.*?\*/", "", text, flags=re.DOTALL)
        return sum(bool(line.strip()) and not line.strip().startswith("//") for line in text.splitlines())
    prose: set[int] = set()
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant) and isinstance(node.value.value, str):
            prose.update(range(node.lineno, (node.end_lineno or node.lineno) + 1))
    lines = enumerate(text.splitlines(), 1)
    return sum(
        bool(line.strip()) and not line.strip().startswith("#") and number not in prose for number, line in lines
    )


def count() -> Counter[str]:
    """Return the code lines of each folder, over files tracked by git."""
    command = ["git", "ls-files", "*.py", "*.js"]
    listed = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True)  # noqa: S603 - no input
    counted: Counter[str] = Counter()
    for name in listed.stdout.splitlines():
        room = next((room for room in ROOMS if name.startswith(room)), None)
        if room and "/vendor/" not in name and (ROOT / name).exists():
            folder = "/".join(name.split("/")[: ROOMS[room]])
            counted[folder] += code_lines(name, (ROOT / name).read_text(encoding="utf-8"))
    return counted


def risen(counted: Counter[str], limits: dict[str, int]) -> list[str]:
    """Return a sentence for each folder that has more code lines than its limit; a new folder has the limit 0."""
    return [
        f"{folder} has {lines} code lines, more than the {limits.get(folder, 0)} in tools/code_lines.json"
        for folder, lines in sorted(counted.items())
        if lines > limits.get(folder, 0)
    ]


def main() -> int:
    """Check the limits, or lower them to the present counts."""
    limits: dict[str, int] = json.loads(LIMITS.read_text(encoding="utf-8"))
    try:
        counted = count()
    except (OSError, subprocess.CalledProcessError):
        sys.stderr.write("Code lines are not counted: this is not a git checkout\n")
        return 0
    if "--lower" in sys.argv[1:]:
        lowered = {folder: min(lines, limits.get(folder, lines)) for folder, lines in sorted(counted.items())}
        LIMITS.write_text(json.dumps(lowered, indent=1) + "\n", encoding="utf-8")
    problems = risen(counted, limits)
    sys.stderr.writelines(f"{problem}\n" for problem in problems)
    return bool(problems)


if __name__ == "__main__":
    sys.exit(main())
