"""The systems that callboard is measured beside, each with its servers and the roles of its processes.

A peer is a module here with `find()`, which gives its contender or says why it is skipped. It needs nothing
installed to be asked.
"""

from __future__ import annotations

PEERS = (
    "nats_py",
    "zenoh_router",
    "zenoh_direct",
    "zenoh_shared_memory",
    "pyzmq_proxy",
    "pyzmq_direct",
    "redis_py",
    "mosquitto",
    "cyclone_dds",
)
