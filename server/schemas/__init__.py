"""Schemas: the shapes of what goes in and out, below all services.

- `rest`, `sweeps`: bodies of requests, and what is answered; `sweep_answers`: maps and rows of a sweep;
- `messages`, `sweep_messages`: the vocabularies of the streams to the pages;
- `panel`: what the panel beside a scene offers and shows;
- `spec`: what is stored of a session.
"""

__all__: list[str] = []
