"""Processes and tasks that are started, stopped and restarted: the engine of the supervisor and of launch.

It may import the node and what is below it, and the runtime (`actors.runtime.programs`), but not launch or the CLI.
"""
