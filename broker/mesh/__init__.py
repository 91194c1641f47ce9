"""The mesh: brokers whose nodes see each other as if one broker had them all.

Pure without `engine/`, and then may import `broker.routing`, `broker.access` and `proto` without `proto.aio`.
"""
