"""Runs as figures, tables, films and notebooks.

- `displays`: runs and comparisons in notebooks and HTML; `figures`: plots and sheets; `exports`: files.
"""
