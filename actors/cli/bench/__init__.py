"""`callboard bench`: three loads of callboard on this machine, without peers.

A checkout has all workloads, and the peers, in `benchmarks/`; this package has what needs no checkout.
"""
