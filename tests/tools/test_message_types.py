"""The types that the pages' scripts are checked against."""

from tools.message_types import PLACE, generate


def test_the_types_are_those_of_the_models() -> None:
    """The file is what the models give now; `python -m tools.message_types` writes it anew."""
    assert PLACE.read_text(encoding="utf-8") == generate()


def test_what_is_sent_is_whole_and_what_is_asked_for_need_not_be() -> None:
    """A field with a default is always there in what the server sends, and may be left out by a page."""
    text = generate()
    assert '  type: "position";\n' in text
    assert "  bookmarks: Bookmark[];\n" in text
    assert "  note?: string;\n" in text
