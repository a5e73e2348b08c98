"""The web layer: routes without a single subject, pages, checks of all requests, and serving."""
