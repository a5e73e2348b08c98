"""`python -m pftrack` is the command line."""

from pftrack.cli import main

main()
