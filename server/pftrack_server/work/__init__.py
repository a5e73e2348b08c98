"""Work: what people have of their own and can take elsewhere, and what is computed of it as jobs.

- `sources`: from the name of a run that is here to what makes it;
- `runs`: saved runs, from a session to a record, or by imports; fits of their numbers; files of other kinds;
- `comparisons`: runs beside each other, computed or kept under a name;
- `explorations`: what would have saved a run, and what other seeds do;
- `page`: a run as one page that needs no server; `routes`: what a person asks for, and the jobs.
"""
