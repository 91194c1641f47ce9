"""Foxglove's WebSocket protocol: topics, services, parameters and the graph for Foxglove and its relatives.

The protocol is pure: `messages.py` has its messages, `session.py` what follows from those of one client. The
other files connect it with the graph. Imports the rest of `actors.web` except `server.py` and `routes/`.
"""
