"""One connection of a node to a broker: opened, kept alive, re-established, and the frames that travel on it.

Imports proto, config, diagnostics, errors and interfaces.errors.
"""
