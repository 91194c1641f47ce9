"""What browsers see as it changes: one session a browser, with the panels that its page shows.

Imports the rest of the package except `server.py` and `routes/`.
"""
