"""`callboard service`."""
