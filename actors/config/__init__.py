"""Configuration from outside: environment variables, contexts (named brokers), and credentials.

Imports proto and errors only. Besides it only `actors.run` and the command line read argv or the environment.
"""
