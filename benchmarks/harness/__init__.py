"""Benchmarks: a harness that measures message systems alike, and callboard's own part in it."""
