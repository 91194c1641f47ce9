"""The router: who is connected to whom, and what follows from each frame, as data for `broker.serving`.

Pure. May import the pure modules of `broker.access`, and `proto` without `proto.aio`.
"""
