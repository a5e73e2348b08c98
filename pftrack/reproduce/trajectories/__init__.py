"""The figures of Ichimura and Ikoma.

- `tracks`: errors on simulated tracks, and the likelihood; `figures` draws them;
- `pictures`: errors of corners that are followed through a simulated sequence.
"""

__all__: list[str] = []
