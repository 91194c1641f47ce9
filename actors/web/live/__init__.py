"""Pushes what browsers show over WebSockets: a session for each browser, with the panels of its page.

Imports the rest of the package except `server.py` and `routes/`.
"""
