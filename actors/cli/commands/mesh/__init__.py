"""`callboard mesh`."""
