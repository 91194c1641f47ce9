"""The mesh's edge: joins a graph of brokers, and carries their messages over Zenoh or another engine.

May import `broker.mesh`, `broker.serving`, `broker.routing`, `broker.access` and `proto`.
"""
