"""Runs scripts: `actors.run`, signals, log output, remaining tasks.

Imports config, node and the packages below.
"""
