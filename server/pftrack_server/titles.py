"""Titles: what people call things, as it is kept and shown."""


def printable(text: str) -> str:
    """Return a text as one line of what can be seen.

    Line ends, control characters and marks that turn the direction of all that follows are left out, since titles stand
    in the middle of lines on pages, in names of files and in logs.
    """
    return " ".join("".join(each for each in text if each.isprintable() or each.isspace()).split())
