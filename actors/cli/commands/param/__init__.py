"""`callboard param`."""
