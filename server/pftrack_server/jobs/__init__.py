"""Jobs: work on untrusted files in confined processes, so that it harms nobody and blocks nobody.

- `child_tasks`: starts child processes for tasks and queues them;
- `jobs`: long work with an id and progress; `results`: the cache of computed results;
- `functions`: the functions that run in confined processes.
"""
