"""Work: people's own runs, comparisons and exports, and the jobs that compute them.

- `sources`: from the name of a run on this server to its recipe;
- `runs`: saved runs, from sessions or imports; fits of parameters; exports;
- `comparisons`: comparisons of runs, computed and saved;
- `explorations`: changes that would have saved a run, and runs with other seeds;
- `page`: a run as one page that needs no server; `routes`: the addresses, and those of all jobs.
"""
