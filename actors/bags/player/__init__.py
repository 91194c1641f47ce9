"""Playing: the node that publishes what a bag has.

Pure: `schedule.py`, when which message is due.
"""
