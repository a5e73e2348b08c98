"""Texts that people read and mend, such as presets and the glossary: YAML files beside what they speak of."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import yaml

_LOADER = getattr(yaml, "CSafeLoader", yaml.SafeLoader)
"""The same, ten times faster, where PyYAML was built with libyaml."""


def read_texts(path: Path) -> tuple[Mapping[str, Any], Mapping[str, str]]:
    """Return what a YAML file declares under its names, and where each of them stands, as "folder/file, line N".

    Raises:
        ValueError: The file is not YAML, or it does not map names to what it declares; it names file and line.
    """
    place = f"{path.parent.name}/{path.name}"
    text = path.read_text(encoding="utf-8")
    try:
        declared = yaml.load(text, Loader=_LOADER)  # noqa: S506 - both loaders are safe
        if not isinstance(declared, dict):
            got = type(declared).__name__
            raise ValueError(f"{place} must map names to what they declare, got {got}")  # noqa: TRY004 - of a file
        root = yaml.compose(text, Loader=_LOADER)
    except yaml.YAMLError as error:
        raise ValueError(f"{place} is not YAML: {error}") from error
    return declared, {key.value: f"{place}, line {key.start_mark.line + 1}" for key, _ in root.value}
