"""`callboard bag`."""
