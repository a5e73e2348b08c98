"""Where the files of the pages are: inside the package where it is installed, beside its folder in a checkout."""

from pathlib import Path

__all__ = ["FRONTEND"]

_INSTALLED = Path(__file__).parent / "frontend_static"

FRONTEND = _INSTALLED if _INSTALLED.is_dir() else Path(__file__).parents[2] / "frontend_static"
