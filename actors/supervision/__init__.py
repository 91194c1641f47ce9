"""Supervision: children that are started, watched, restarted and stopped together."""
