"""The HTTP API, a file for each area. Each has `ROUTES`, which `server.py` adds.

Imports the rest of the package except `server.py`.
"""
