"""The turning prism: its pose by adaptive sampling of its corners (document 1, ch. 4 section 3)."""

__all__: list[str] = []
