"""The wire protocol between nodes and brokers, without I/O; `proto.aio` adds asyncio."""
