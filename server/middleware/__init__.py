"""Middleware: what every request passes before a handler sees it.

- `security`: host, origin and token; `body_limit`: how much may be sent; `metrics`: counts and times for Prometheus.
"""

__all__: list[str] = []
