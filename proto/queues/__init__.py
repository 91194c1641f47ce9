"""Unsent frames: batches, the queues of publishers and of calls, and the order in which a link sends them.

Pure. May import `proto.wire` and the modules of `proto` itself.
"""
