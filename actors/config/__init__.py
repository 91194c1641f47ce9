"""Configuration from outside: environment variables, and contexts, which are named brokers.

Imports proto only. Besides it only `actors.run` and the command line read argv or the environment.
"""
