"""`callboard interface`."""
