"""The graph: queries and changes as a node sees them, snapshots, and the blocking inspector.

Imports session, endpoints (its context and base classes), config, qos, time and proto.
"""
