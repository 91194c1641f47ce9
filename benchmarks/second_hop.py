"""Several servers of one system, joined, as one contender: each role connects to the server next to it.

    python benchmarks/second_hop.py serve '[[port, [command ...]], ...]'    the near server is the first
    python benchmarks/second_hop.py role command ... '{"url": "near,far,...", ...}'

Both become what they start, so that the signals and the CPU time of a trial's process are the real one's (of
the servers: the near one's).
"""

# ruff: noqa: E402 - the path comes before the imports that need it

from __future__ import annotations

import json
import os
import socket
import subprocess
import sys
import time
from pathlib import Path

# Not this folder itself, whose modules could hide others of the same name.
sys.path[0] = str(Path(__file__).resolve().parent.parent)

from benchmarks.harness.processes import SERVER_TIMEOUT_S, killed_with_parent

FAR = frozenset({"subscriber", "server"})
"""Roles that connect to a far server: to the one of their number, if they have one."""
INTERVAL_S = 0.01


def listening(port: int) -> None:
    """Wait until a server listens."""
    deadline = time.monotonic() + SERVER_TIMEOUT_S
    while True:
        try:
            socket.create_connection(("127.0.0.1", port), 1.0).close()
        except ConnectionRefusedError:
            if time.monotonic() > deadline:
                raise
            time.sleep(INTERVAL_S)
        else:
            return


def serve(servers: str) -> None:
    """Start the far servers, wait until they listen, and become the near one."""
    (_, near), *others = json.loads(servers)
    for _, command in others:
        subprocess.Popen(killed_with_parent(command))  # in this process group, which the trial kills
    for port, _ in others:
        listening(port)
    os.execvp(near[0], near)


def role(*arguments: str) -> None:
    """Become a role that has the URL of its own server."""
    *command, text = arguments
    parameters = json.loads(text)
    near, *others = parameters["url"].split(",")
    far = parameters["role"] in FAR and others
    parameters["url"] = others[parameters.get("number", 0) % len(others)] if far else near
    os.execvp(command[0], [*command, json.dumps(parameters)])


if __name__ == "__main__":
    if sys.argv[1] == "serve":
        serve(sys.argv[2])
    role(*sys.argv[2:])
