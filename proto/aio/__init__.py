"""The asyncio edge that both ends share: a connection's byte channel, and how a process is configured.

Imports proto; uvloop where the platform has it.
"""
