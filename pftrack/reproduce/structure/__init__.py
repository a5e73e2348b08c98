"""The figures of document 1, ch. 4 section 5: shape errors (`shape`) of single reconstructions (`course`)."""

__all__: list[str] = []
