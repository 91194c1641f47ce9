"""What a launch shows and writes: the screen, JSON lines, log files.

Imports engine, planning and description; listens to events only.
"""
