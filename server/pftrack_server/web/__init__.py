"""The way in: routes that belong to no single subject, pages, what guards all requests, and serving."""
