"""Measurements of failures and restarts: processes in roles, timings, and their tables."""
