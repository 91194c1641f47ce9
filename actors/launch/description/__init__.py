"""What launch files can say, as plain data: actions, conditions, substitutions, event handlers.

Imports nothing of launch but its errors.
"""
