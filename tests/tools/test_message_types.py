"""The types that the pages' scripts are checked against."""

from tools.message_types import files


def test_the_types_are_those_of_the_models() -> None:
    """The files are what the models give now; `python -m tools.message_types` writes them anew."""
    for path, text in files().items():
        assert path.read_text(encoding="utf-8") == text, path.name
