"""An experiment for pftrack: several hypotheses about a target that turns out of sight."""
