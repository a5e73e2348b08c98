"""Middleware: what every request passes before a handler sees it.

- `errors`: an answer to every exception, in one shape
- `security`: host, origin and token; `body_limit`: how much may be sent; `metrics`: counts and times for Prometheus.
"""

__all__: list[str] = []
