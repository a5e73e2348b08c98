"""Work: what people have of their own and can take elsewhere, and what is computed of it as jobs.

- `sources`: from the name of a run that is here to what makes it;
- `runs`: saved runs, from a session to a record, by imports, and back to a session; fits of their numbers;
- `comparisons`: runs beside each other, computed or kept under a name;
- `explorations`: what would have saved a run, and what other seeds do;
- `exports`: runs and comparisons as files; `page`: a run as one page that needs no server.
"""

__all__: list[str] = []
