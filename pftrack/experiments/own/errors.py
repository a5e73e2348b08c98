"""What is wrong with a filter in a file, with the line where it shows."""

__all__ = ["FilterFileError"]


class FilterFileError(ValueError):
    """A filter that cannot go on; the run stands where it was.

    Attributes:
        file: Name of the file.
        line: Where it shows, from 1; None where no line can be named.
        problem: What is wrong, a clause.
    """

    def __init__(self, file: str, line: int | None, problem: str) -> None:
        place = file if line is None else f"{file}, line {line}"
        super().__init__(f"{place}: {problem}")
        self.file = file
        self.line = line
        self.problem = problem

    def __reduce__(self) -> tuple[type["FilterFileError"], tuple[str, int | None, str]]:
        """Travel between processes whole."""
        return type(self), (self.file, self.line, self.problem)
