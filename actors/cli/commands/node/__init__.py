"""`callboard node`."""
