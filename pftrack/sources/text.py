"""Text of files that people have saved with one program or another."""

__all__ = ["decode", "delimiter_of"]


def decode(data: bytes) -> str:
    """Return text, by its mark of byte order, as UTF-8, or else as Windows has it in Western Europe."""
    for mark, encoding in ((b"\xef\xbb\xbf", "utf-8-sig"), (b"\xff\xfe", "utf-16"), (b"\xfe\xff", "utf-16")):
        if data.startswith(mark):
            return data.decode(encoding, "replace")
    try:
        return data.decode("utf-8")
    except UnicodeDecodeError:
        return data.decode("cp1252", "replace")


def delimiter_of(line: str) -> str:
    """Return what separates the cells of a table's header: the most frequent of comma, semicolon and tab."""
    return max(",;\t", key=line.count)
