"""The wire protocol between nodes and brokers, without I/O; `proto.aio` adds asyncio.

Imports nothing of callboard. Inside, `aio` may import `queues`, which may import `wire`; all of them may
import the modules here.
"""
