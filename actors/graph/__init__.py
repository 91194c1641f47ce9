"""The graph: queries and changes as a node sees them, snapshots, and the blocking inspector.

Imports endpoints.context, endpoints.endpoint, qos, time and proto.
"""
