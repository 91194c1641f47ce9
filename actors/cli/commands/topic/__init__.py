"""`callboard topic`."""
