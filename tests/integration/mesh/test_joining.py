"""Brokers of a mesh that must have a password."""

from __future__ import annotations

import asyncio
from typing import TYPE_CHECKING

import zenoh

from broker import BrokerOptions
from broker.mesh.engine.zenoh_config import make_config
from tests.integration.conftest import free_port
from tests.integration.mesh.stations import MeshBroker, Station, wait_until_joined

if TYPE_CHECKING:
    from contextlib import AsyncExitStack
    from pathlib import Path

    from tests.integration.conftest import System


def password(folder: Path, text: str) -> Path:
    """Write a file with a user and a password."""
    path = folder / text
    path.write_text(f"robot:{text}\n")
    path.chmod(0o600)
    return path


async def test_brokers_with_one_password_join(system: System, stack: AsyncExitStack, tmp_path: Path) -> None:
    """The log of the one that connects says so."""
    auth = str(password(tmp_path, "right"))
    first = await MeshBroker(system).start("--mesh-auth", auth)
    second = await MeshBroker(system, [first]).start("--mesh-auth", auth)
    stations = [
        await stack.enter_async_context(Station(f"s{i}", b.url)) for i, b in enumerate((first, second))
    ]
    await wait_until_joined(*stations)


async def test_a_broker_with_another_password_is_told_so(system: System, tmp_path: Path) -> None:
    """Its log names the endpoint and the likely reason."""
    first = await MeshBroker(system).start("--mesh-auth", str(password(tmp_path, "right")))
    second = await MeshBroker(system, [first]).start("--mesh-auth", str(password(tmp_path, "wrong")))
    assert second.program is not None
    line = await second.program.wait_for_line("Mesh: no connection")
    assert f"with {first.endpoint}: it does not let this broker in (another password" in line


async def test_a_broker_of_another_version_is_named_once(system: System) -> None:
    """Whatever its domains and its number look like."""
    first = await MeshBroker(system).start()
    session = await asyncio.to_thread(zenoh.open, make_config(BrokerOptions(mesh=first.endpoint)))
    try:
        keys = ("callboard/2/0/alive/robot-1", "callboard/2/lab/alive/robot-1", "callboard/3/0/alive/last")
        tokens = [session.liveliness().declare_token(key) for key in keys]
        assert first.program is not None
        lines = [await first.program.wait_for_line("Mesh: the broker") for _ in range(2)]
        text = "speaks version {} of the mesh, this one 1: update the older one"
        assert sorted(line.partition("Mesh: the broker ")[2] for line in lines) == [
            f"last {text.format(3)}",
            f"robot-1 {text.format(2)}",
        ]
        assert len(tokens) == len(keys)
    finally:
        await asyncio.to_thread(session.close)


async def test_the_log_of_zenoh_is_there_if_it_is_asked_for(system: System, tmp_path: Path) -> None:
    """And has no password in it, if it is asked for as the guide says."""
    system.variables["RUST_LOG"] = "zenoh::net=debug"
    dead = f"tcp/127.0.0.1:{free_port()}"
    broker = await MeshBroker(system, [dead]).start("--mesh-auth", str(password(tmp_path, "sesame")))
    assert broker.program is not None
    await broker.program.wait_for_line(f"Unable to connect to configured peer {dead}")
    assert not [line for line in broker.program.lines if "sesame" in line]


async def test_there_is_no_negative_domain(system: System) -> None:
    """A token with one would make a broker keep a graph for it, and tokens cost others nothing."""
    first = await MeshBroker(system).start()
    session = await asyncio.to_thread(zenoh.open, make_config(BrokerOptions(mesh=first.endpoint)))
    try:
        token = session.liveliness().declare_token("callboard/1/-5/alive/0000000a")
        assert first.program is not None
        line = await first.program.wait_for_line("Mesh: received something malformed")
        assert "there is no domain -5" in line
        assert token is not None
    finally:
        await asyncio.to_thread(session.close)
