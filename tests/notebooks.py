"""Executing notebooks: in a kernel of their own, as a person would run them, or in this process where one was."""

import io
from contextlib import redirect_stdout
from typing import Any

import matplotlib.pyplot as plt
import nbformat
from nbclient import NotebookClient


def executed(content: bytes) -> list[str]:
    """Run a notebook and return what each of its cells of code prints; an exception in a cell is raised here."""
    book = nbformat.reads(content.decode(), as_version=4)
    NotebookClient(book, timeout=100, kernel_name="python3").execute()
    return [
        "".join(output["text"] for output in cell["outputs"] if output["output_type"] == "stream")
        for cell in book["cells"]
        if cell["cell_type"] == "code"
    ]


def executed_here(content: bytes) -> str:
    """Run the code of a notebook in this process and return what it prints: a kernel takes seconds to start."""
    known: dict[str, Any] = {}
    with redirect_stdout(io.StringIO()) as printed, plt.rc_context({"backend": "agg"}):
        for cell in nbformat.reads(content.decode(), as_version=4)["cells"]:
            if cell["cell_type"] == "code":
                exec(cell["source"], known)  # noqa: S102 - of the project's own making
    plt.close("all")
    return printed.getvalue()
