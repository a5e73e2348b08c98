"""Exports: what a run can be written as, and what shows one; above the runs, which know none of it."""
