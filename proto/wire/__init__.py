"""The wire format: frames and their codec, names, sessions, types and URLs.

Pure. May import `proto.errors`, `proto.limits` and the other modules of `proto` itself.
"""
