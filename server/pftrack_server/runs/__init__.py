"""Saved runs: from a session to a record that can be downloaded, imported elsewhere and opened again (`service`)."""

__all__: list[str] = []
