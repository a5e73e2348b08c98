"""`python -m pftrack` is the command line."""

from pftrack.cli.app import main

main()
