"""Exports: formats and viewers of runs; the runs do not depend on them."""
