"""Nodes, topics, services and timers on asyncio: callboard's public API."""
