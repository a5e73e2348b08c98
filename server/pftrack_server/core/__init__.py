"""The base of the whole server: settings, base path, the one shape of errors, requests, log and limits."""
