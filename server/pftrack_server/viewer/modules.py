"""Modules of a page as one script, for a page that has nowhere to fetch them from."""

import re
from collections.abc import Iterable
from pathlib import Path

IMPORT = re.compile(r"^import [^;]*;$|^/\*\* @import [^\n]*\*/$|^export (?=class|const|function)", re.MULTILINE)


def join(modules: Iterable[Path]) -> str:
    """Return modules as one script, in which they see each other's names without importing them.

    Args:
        modules: Each after those that it imports. No two of them use one name for different things.
    """
    texts = (module.read_text(encoding="utf-8") for module in modules)
    return f'(() => {{\n"use strict";\n{IMPORT.sub("", "".join(texts))}}})();'
