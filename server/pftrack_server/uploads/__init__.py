"""Uploads: from the body of a request to frames for tracking.

- `multipart`: reads files from a body, within limits; `intake`: decodes them once, by `probe`, and stores them;
- `truth`: truth tables of uploads; `routes`: the addresses, and the judgement of a target's suitability.
"""
