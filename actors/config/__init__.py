"""Configuration from outside: environment variables, `--ros-args`, remapping rules, broker contexts.

Imports parameters, logging and proto. Nothing else but `actors.run` and the command line reads argv or
the environment.
"""
