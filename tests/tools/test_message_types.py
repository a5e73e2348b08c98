"""The types that the pages' scripts are checked against."""

from tools.message_types import files


def test_the_types_are_those_of_the_models() -> None:
    """The files are what the models give now; `python -m tools.message_types` writes them anew."""
    for path, text in files().items():
        assert path.read_text(encoding="utf-8") == text, path.name


def test_what_is_sent_is_whole_and_what_is_asked_for_need_not_be() -> None:
    """A field with a default is always there in what the server sends, and may be left out by a page."""
    text = "".join(files().values())
    assert '  type: "changes";\n' in text
    assert "  bookmarks: Bookmark[];\n" in text
    assert "  note?: string;\n" in text
    assert '  kind: "strip chart";\n' in text


def test_a_number_of_a_figure_may_be_a_gap() -> None:
    """What is not finite comes as null."""
    (figures,) = (text for path, text in files().items() if path.name == "types.d.ts")
    assert "  heights: (number | null)[];\n" in figures
    assert "  values: ((number | null)[])[];\n" in figures


def test_changes_are_a_part_of_what_moves() -> None:
    """A message of changes has the fields of the snapshot, any of them."""
    text = "".join(files().values())
    assert "  session: Partial<SessionSnapshot>;\n" in text
