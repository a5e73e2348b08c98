"""Whether this machine is ready: checks of what pftrack needs, and compiling in advance."""
