"""The store: what people made, safe from a crash at any moment.

Rows live in a SQLite database with a write-ahead log, long things as files beside it, written whole and renamed, under
names that the server made up.

- `database`: the rows, the connection, and the tables that are made at the first start
- `disk_budget`: how much may still be written, and errors of disk and database in words
- `filters`: the filter files of the server's owner
- `files`: the data directory
- `store`: everything that is asked of the store, in one class
"""

from pftrack_server.store.store import Store

__all__ = ["Store"]
