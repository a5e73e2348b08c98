"""The turning prism: its pose by adaptive sampling of its corners (Bando 2007, ch. 4 section 3)."""

__all__: list[str] = []
