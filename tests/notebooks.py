"""Executing notebooks: in a kernel of their own, as a person would run them."""

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
