"""Processes and tasks that are started, stopped and restarted: the engine of the supervisor and of launch.

It may import the node, the runtime and what is below them, but not launch or the command line.
"""
