"""The parameters of other nodes: a client of their parameter services, and callbacks for their changes.

Imports node and everything below it.
"""
