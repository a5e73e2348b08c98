"""The stream to the pages: `duplex` joins a websocket to its `listeners`."""

__all__: list[str] = []
