"""What waits to travel: batches, the queues of publishers and of calls, and the order of sending.

Pure. May import `proto.wire` and the modules of `proto` itself.
"""
