"""The version of the library, apart from what offers it, so that all can write it into their files."""

__version__ = "1.1.0"
