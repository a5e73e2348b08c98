"""Readiness of this machine: checks of pftrack's requirements, and compiling in advance."""
