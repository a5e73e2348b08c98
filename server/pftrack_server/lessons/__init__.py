"""Lessons: what the server adds to those of the library, which hold all text, mathematics and judgement.

- `functions`: what is computed of them, in other processes: by a pool of workers, or as a child task;
- `results`: checks and whole runs, computed once and kept;
- `service`: all of it together, and `views`: lessons as pages see them;
- `text`: their Markdown as HTML.
"""

__all__: list[str] = []
