"""What all of the server is built on: settings, base path, the one shape of errors, requests, log and limits."""
