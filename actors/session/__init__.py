"""One connection of a node to a broker: opened, kept alive, re-established, and the frames that travel on it.

Imports proto, config, errors and interfaces.errors.
"""
