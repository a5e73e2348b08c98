"""Schemas: the shapes of what goes in and out, below all services.

- `experiments`, `uploads`, `sessions`, `jobs`, `work`, `sweeps`: what requests bring (`Create`, `Update`) and what is
  answered (`Public`), by resource; `body`: what requests have in common;
- `messages`: the vocabulary of a session's stream; `stream`: what all streams have in common;
- `panel`: what the panel beside a scene offers and shows;
- `spec`: what is stored of a session.
"""

__all__: list[str] = []
