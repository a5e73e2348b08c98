"""The store: everything that people made, safe from a crash at any moment.

Rows are in a SQLite database with a write-ahead log. Large content is in files next to it, written whole and renamed,
under names made by the server.

- `database`: the rows, the connection, and the tables, made at the first start
- `disk_budget`: free disk space, and messages for errors of disk and database
- `filters`: the filter files of the server's owner
- `files`: the data directory
- `store`: all operations, in one class
"""

from pftrack_server.store.store import Store

__all__ = ["Store"]
