"""Reading results: which form a file has, its content tells; what was guessed is said."""

from collections.abc import Callable
from pathlib import Path

from pftrack.sources.cells import decode
from pftrack.sources.limits import SourceError
from pftrack.sources.results.numbers import form_of, form_of_lines, read_mot, read_rows
from pftrack.sources.results.table import FORMS, Form, ResultTable, read_csv
from pftrack.sources.results.writing import read_coco, read_cvat

LARGEST_FILE_BYTES = 64 * 1024 * 1024


def read_results(
    data: bytes, *, form: Form | None = None, first_frame: int | None = None, first_pixel: int | None = None
) -> ResultTable:
    """Read the content of a file.

    Args:
        data: The content.
        form: What it is; told by itself if not given.
        first_frame: Number of the first frame in MOTChallenge text; told by itself if not given.
        first_pixel: Number of the first pixel in text of numbers; as the form has it if not given.

    Raises:
        SourceError: It is none, a line of it is wrong, or it is too large.
    """
    if len(data) > LARGEST_FILE_BYTES:
        raise SourceError(f"results may have at most {LARGEST_FILE_BYTES // 1024**2} MiB")
    found = form or form_of(data)
    if found == "mot":
        return read_mot(data, first_frame, first_pixel)
    if found in {"otb", "vot"}:
        # Only the whole file tells whether all of its numbers are whole ones.
        whole = form or form_of_lines(decode(data).splitlines()) or found
        return read_rows(data, whole, first_pixel)
    readers: dict[str, Callable[[bytes], ResultTable]] = {"cvat": read_cvat, "coco": read_coco, "csv": read_csv}
    if found is None:
        raise SourceError(f"the file is none of results; expected {', '.join(FORMS.values())}")
    return readers[found](data)


def read_results_file(
    path: Path, *, form: Form | None = None, first_frame: int | None = None, first_pixel: int | None = None
) -> ResultTable:
    """Read a file; see `read_results`.

    Raises:
        SourceError: It cannot be read, or is none; the sentence begins with its name.
    """
    try:
        with path.open("rb") as file:
            data = file.read(LARGEST_FILE_BYTES + 1)
        return read_results(data, form=form, first_frame=first_frame, first_pixel=first_pixel)
    except OSError as error:
        raise SourceError(f"{path.name} cannot be read: {error.strerror}") from None
    except SourceError as error:
        raise SourceError(f"{path.name}: {error}") from None
