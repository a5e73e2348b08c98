"""Comparisons of runs: named by references or by recipes, outlined at once, and computed as jobs.

- `references`: from the name of a run that is here to what makes it;
- `service`: the comparisons under way, and what came of them.
"""

__all__: list[str] = []
