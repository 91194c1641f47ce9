"""`callboard bridge`."""
