"""The version of the library, in a separate module so that all parts can write it into their files."""

__version__ = "1.1.0"
