"""What a description may ask of the computer: launch files, packages, scripts, factories, commands.

Imports documents, planning, description and `actors.processes`.
"""
