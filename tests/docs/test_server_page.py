"""The page on the server: its table of variables is that of the settings."""

import re
from pathlib import Path

from pydantic.fields import FieldInfo
from pydantic_core import PydanticUndefined

from pftrack_server.core.settings import MEBIBYTE, Settings

ROOT = Path(__file__).parents[2]
PAGE = ROOT / "docs" / "how-to" / "server.md"
BESIDE_SETTINGS = {"PFTRACK_DEBUG"}
"""Variables that are not settings."""


def shown(name: str, field: FieldInfo) -> str:
    """A default as a person reads it."""
    value = field.default
    if value is PydanticUndefined:
        return "one a processor"
    if value is None or value in {(), ""}:
        return "none"
    if name.endswith("_bytes"):
        return f"{value} ({value // MEBIBYTE:,} MiB)"
    return f"{value:g}" if isinstance(value, float) else str(value)


def test_the_table_is_that_of_the_settings() -> None:
    """The table has a row for each setting, with default and meaning, in the same order, and each named variable."""
    page = PAGE.read_text()
    rows = re.findall(r"^\| (`PFTRACK_\w+`) \| (.*?) \| (.*?) \|$", page, re.MULTILINE)
    assert [row for row in rows if row[0].strip("`") not in BESIDE_SETTINGS] == [
        (f"`PFTRACK_{name.upper()}`", shown(name, field), field.description or "")
        for name, field in Settings.model_fields.items()
    ]
    files = [path for folder in ("pftrack", "server", "docker") for path in (ROOT / folder).rglob("*")]
    code = "\n".join(path.read_text() for path in files if path.suffix in {".py", ".yaml"})
    named = set(re.findall(r"\bPFTRACK_[A-Z][A-Z_]*[A-Z]\b", code))
    assert named >= BESIDE_SETTINGS
    assert {name for name in named if f"| `{name}` |" not in page} == set()
