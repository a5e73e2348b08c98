"""Schemas: the shapes of what goes in and out, below all services.

- `experiments`, `uploads`, `sessions`, `runs`, `sweeps`: what requests bring (`Create`, `Update`) and what is answered
  (`Public`), by resource; `body`: what requests have in common; `sweep_answers`: maps and rows of a sweep;
- `messages`, `sweep_messages`: the vocabularies of the streams to the pages; `stream`: what both have in common;
- `panel`: what the panel beside a scene offers and shows;
- `spec`: what is stored of a session.
"""

__all__: list[str] = []
