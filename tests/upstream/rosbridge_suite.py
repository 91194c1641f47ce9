"""Record what rosbridge_suite answers on real ROS 2, in build/ros2: tests compare callboard with it.

git clone https://github.com/RobotWebTools/rosbridge_suite
build/ros2/bin/pip install --target needed tornado cbor Pillow pymongo ujson
export ROSBRIDGE_CHECKOUT=$PWD/rosbridge_suite PYTHONPATH=needed
python -m tests.upstream.rosbridge_suite
"""

from __future__ import annotations

import asyncio
import json
import os
import re
import sys
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Final

import aiohttp

from tests.actors.web.rosbridge.questions import answers
from tests.ports import held_port
from tests.real_ros import REAL_PYTHON

RECORDED: Final = Path(__file__).parents[1] / "actors" / "web" / "rosbridge" / "recorded.json"
PATIENCE_SEC: Final = 3.0
DOMAIN: Final = "83"

SOURCE: Final = """
import runpy, sys, types
manager = types.ModuleType("rosbridge_server.client_manager")  # needs rosbridge_msgs, which is no wheel
class ClientManager:
    __init__ = add_client = remove_client = lambda *_: None
manager.ClientManager = ClientManager
sys.modules[manager.__name__] = manager
sys.path[:0] = [f"{sys.argv[1]}/rosbridge_library/src", f"{sys.argv[1]}/rosbridge_server/src"]
script = f"{sys.argv[1]}/rosbridge_server/scripts/rosbridge_websocket.py"
sys.argv = ["rosbridge", "--port", sys.argv[2]]
runpy.run_path(script, run_name="__main__")
"""


async def record(checkout: Path) -> None:
    """Write the answers.

    Args:
        checkout: Of rosbridge_suite.
    """
    package = (checkout / "rosbridge_server" / "package.xml").read_text(encoding="utf-8")
    (version,) = re.findall("<version>(.*)</version>", package)
    with held_port() as port, TemporaryDirectory() as logs:
        words = ("-c", SOURCE, str(checkout), str(port))
        environ = {**os.environ, "ROS_DOMAIN_ID": DOMAIN, "ROS_LOG_DIR": logs}
        server = await asyncio.create_subprocess_exec(str(REAL_PYTHON), *words, env=environ)
        try:
            async with aiohttp.ClientSession() as session:
                found = await answers(partial(connected, session, port), PATIENCE_SEC)
        finally:
            server.kill()
            await server.wait()
    document = {"rosbridge_suite": version, "answers": found}
    RECORDED.write_text(json.dumps(document, indent=2, ensure_ascii=False) + "\n", encoding="utf-8")


async def connected(session: aiohttp.ClientSession, port: int) -> aiohttp.ClientWebSocketResponse:
    """Return a WebSocket of the server, which takes seconds to start."""
    while True:
        try:
            return await session.ws_connect(f"ws://127.0.0.1:{port}")
        except aiohttp.ClientError:
            await asyncio.sleep(0.1)


if __name__ == "__main__":
    asyncio.run(record(Path(os.environ.get("ROSBRIDGE_CHECKOUT") or sys.exit(__doc__))))
