"""The configuration of a broker's Zenoh session."""

from __future__ import annotations

import json

import zenoh


def config_for(listen: str | None, connect: str | None) -> zenoh.Config:
    """Return the configuration of a session in router mode, without scouting."""
    config = zenoh.Config()
    settings: dict[str, object] = {
        "mode": "router",
        "scouting/multicast/enabled": False,
        "scouting/delay": 0,  # how long `zenoh.open` waits for what scouting finds
        "scouting/gossip/enabled": False,
        "listen/endpoints": [listen] if listen else [],
        "connect/endpoints": connect.split(",") if connect else [],
        "transport/link/tx/lease": 3000,
    }
    for key, value in settings.items():
        config.insert_json5(key, json.dumps(value))  # pyright: ignore[reportUnknownMemberType]
    return config
