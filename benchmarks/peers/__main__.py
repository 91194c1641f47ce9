"""A role of a peer, as a process of its own.

python benchmarks/peers PEER '<json parameters>' a role, which its parent tells when to go python
benchmarks/peers PEER serve URL the server of a peer that has one in Python
"""

from __future__ import annotations

import importlib
import sys
from pathlib import Path

# Not this folder itself: its modules must hide nobody's.
sys.path[0] = str(Path(__file__).resolve().parents[2])


def main() -> None:
    peer = importlib.import_module(f"benchmarks.peers.{sys.argv[1]}")
    if sys.argv[2] == "serve":
        peer.serve(*sys.argv[3:])
        return
    roles = importlib.import_module("benchmarks.peers.roles")
    roles.run(peer.ROLES, sys.argv[2])


if __name__ == "__main__":
    main()
