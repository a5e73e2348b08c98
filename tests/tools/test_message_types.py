"""The types that the pages' scripts are checked against."""

from tools.message_types import files


def test_the_types_are_those_of_the_models() -> None:
    """The files are what the models give now; `python -m tools.message_types` writes them anew.

    A field with a default is always there in what the server sends, and may be left out by a page. What is not finite
    comes as null, and a message of changes has the fields of the snapshot, any of them.
    """
    found = files()
    for path, text in found.items():
        assert path.read_text(encoding="utf-8") == text, path.name
    for line in (
        '  type: "changes";',
        "  bookmarks: Bookmark[];",
        "  note?: string;",
        '  kind: "strip chart";',
        "  heights: (number | null)[];",
        "  values: ((number | null)[])[];",
        "  session: Partial<SessionSnapshot>;",
    ):
        assert f"{line}\n" in "".join(found.values())
