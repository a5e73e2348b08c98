"""Uploads: from the body of a request to frames that can be tracked.

- `multipart`: files out of a body, within limits; `intake`: files that are decoded once, by `probe`, and kept;
- `truth`: tables of what is true in an upload; `routes`: the addresses, and whether a target can be followed.
"""
