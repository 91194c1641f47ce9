"""The library of this machine: launch files, packages, scripts, node factories, commands.

Imports documents, planning, description and `actors.processes`.
"""
