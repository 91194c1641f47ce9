#!/usr/bin/env bash
# eclipse-zenoh 1.10.2, Python 3.11 on Linux x86-64, seen on 2026-11-28.
#
# A sample's timestamp has a time and the id of a session. A client publishes to a router, without a timestamp of its own.
#
# Guess: the id in the timestamp is that of the session that published, so it tells where a sample comes from.
# Seen: it is the router's: whoever adds the timestamp signs it. Only one that the client makes itself, with
#       `session.new_timestamp()`, has the client's id. To tell the publisher a sample needs `source_info`.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3.11 -m venv "$folder/env"
"$folder/env/bin/pip" install --quiet --disable-pip-version-check eclipse-zenoh==1.10.2
"$folder/env/bin/python" - <<'PYTHON' || { echo "It is no longer so." >&2; exit 1; }
import json
import queue
import socket
import sys

import zenoh

with socket.socket() as found:
    found.bind(("127.0.0.1", 0))
    address = f"tcp/127.0.0.1:{found.getsockname()[1]}"


def session(mode, key):
    config = zenoh.Config()
    config.insert_json5("mode", json.dumps(mode))
    config.insert_json5(f"{key}/endpoints", json.dumps([address]))
    config.insert_json5("scouting/multicast/enabled", "false")
    return zenoh.open(config)


samples = queue.Queue()
with session("router", "listen") as router, session("client", "connect") as client:
    subscriber = router.declare_subscriber("a", samples.put)
    ids = {str(router.zid()): "router", str(client.zid()): "client"}
    client.put("a", b"")
    client.put("a", b"", timestamp=client.new_timestamp())
    seen = [ids.get(str(samples.get(timeout=10).timestamp.get_id()), "another") for _ in range(2)]
    subscriber.undeclare()
print(seen)
sys.exit(seen != ["router", "client"])
PYTHON
