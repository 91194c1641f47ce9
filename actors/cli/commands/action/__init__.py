"""`callboard action`."""
