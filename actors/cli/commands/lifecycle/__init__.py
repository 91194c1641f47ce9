"""`callboard lifecycle`."""
