"""The store: what people made, safe from a crash at any moment.

Rows live in a database (SQLite with a write-ahead log, or any other by URL), long things as files beside it, written
whole and renamed, under names that the server made up.

- `database`: the rows, the connection, and the tables that are made at the first start
- `files`: the data directory
- `store`: everything that is asked of the store, in one class
"""

from pftrack_server.store.store import Store

__all__ = ["Store"]
