"""The systems that callboard is measured beside, each with its servers and the roles of its processes.

A peer is a module here with `find()`, which gives its contender or says why it is skipped. It needs nothing
installed to be asked.

nats_py, redis_py, mosquitto (aiomqtt) and pyzmq_asyncio are asyncio clients, as callboard is. The Zenoh
peers, pyzmq_proxy, pyzmq_direct, cyclone_dds and iceoryx2 are native libraries under a blocking API, with
threads of their own: an asyncio application pays for a bridge to them that is not measured here. Each
contender's version says which of the two it is, so that the report does.
"""

from __future__ import annotations

PEERS = (
    "nats_py",
    "zenoh_router",
    "zenoh_direct",
    "zenoh_shared_memory",
    "pyzmq_proxy",
    "pyzmq_direct",
    "pyzmq_asyncio",
    "redis_py",
    "mosquitto",
    "cyclone_dds",
    "iceoryx2",
)
