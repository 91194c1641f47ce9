"""Nodes and inspectors at a broker with access rules."""

from __future__ import annotations

import asyncio
from typing import TYPE_CHECKING

import pytest

from actors import Inspector, Node, NotAuthorized
from actors.cli.main import main
from broker import Broker, BrokerOptions
from broker.access.credentials import hash_token
from tests.actors.meeting import BARE, DEADLINE_SEC
from tests.ports import held_port
from tests.seams.limits import be_patient

if TYPE_CHECKING:
    from collections.abc import AsyncIterator
    from pathlib import Path

TOKEN = "cbt_" + "t" * 43
OTHER = "cbt_" + "o" * 43


def rules(token: str) -> str:
    """Return rules with one user who may do everything."""
    rights = "\n".join(
        f'allow.{word} = ["/**"]'
        for word in ("publish", "subscribe", "serve", "call", "see", "administer", "node")
    )
    return f'[users.robot]\ntokens = ["{hash_token(token)}"]\nroles = ["all"]\n[roles.all]\n{rights}\n'


@pytest.fixture
async def broker(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> AsyncIterator[Broker]:
    """A broker with one user, where nodes look for one; its port stays the test's."""
    be_patient(monkeypatch)
    file = tmp_path / "access.toml"
    file.write_text(rules(TOKEN))
    with held_port() as port:
        async with Broker(BrokerOptions(port=port, auth=file)) as running:
            monkeypatch.setenv("CALLBOARD_URL", running.url)
            yield running


async def test_a_node_presents_its_token(broker: Broker, monkeypatch: pytest.MonkeyPatch) -> None:
    """CALLBOARD_TOKEN is enough."""
    monkeypatch.setenv("CALLBOARD_TOKEN", TOKEN)
    async with Node("n", **BARE) as node:
        assert node.connected
        assert broker.stats().endpoints == 1


async def test_a_token_of_the_program_wins(broker: Broker, monkeypatch: pytest.MonkeyPatch) -> None:
    """`Node(token=...)`, against an environment for another user; the node knows who it is."""
    monkeypatch.setenv("CALLBOARD_TOKEN", OTHER)
    async with Node("n", token=TOKEN, **BARE) as node:
        assert node.user == "robot"
    with pytest.raises(NotAuthorized, match="presented the token in the argument `token`"):
        async with Node("m", token=OTHER, **BARE):
            raise AssertionError("the broker takes any token")
    assert broker.stats().unauthorized_connections == 1


async def test_without_rules_nobody_is_a_user(monkeypatch: pytest.MonkeyPatch) -> None:
    """Whatever is presented."""
    be_patient(monkeypatch)
    async with (
        Broker(BrokerOptions(port=0)) as without,
        Node("n", url=without.url, token=TOKEN, **BARE) as node,
    ):
        assert node.user is None


@pytest.mark.parametrize(
    ("variable", "token", "hint"),
    [
        ("CALLBOARD_TOKEN", "", "Name a file with a token in CALLBOARD_TOKEN_FILE"),
        ("CALLBOARD_TOKEN", OTHER, "presented the token in CALLBOARD_TOKEN; if it is wrong,"),
        ("CALLBOARD_TOKEN_FILE", OTHER, "presented the token in /.*/wrong.token;"),
    ],
)
async def test_a_node_without_a_valid_token_ends(
    broker: Broker, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, variable: str, token: str, hint: str
) -> None:
    """It does not try for ever: the error names what to set, or the source of the wrong token."""
    file = tmp_path / "wrong.token"
    file.write_text(token)
    monkeypatch.setenv(variable, str(file) if variable == "CALLBOARD_TOKEN_FILE" else token)
    with pytest.raises(NotAuthorized, match=hint) as caught:
        async with asyncio.timeout(DEADLINE_SEC), Node("n"):
            pass
    assert OTHER not in str(caught.value)


async def test_a_running_node_waits_for_credentials_that_are_valid_again(
    broker: Broker, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    """After a lost session it keeps trying, reads the token's file again, and has logged the refusal once."""
    token = tmp_path / "token"
    token.write_text(TOKEN)
    monkeypatch.setenv("CALLBOARD_TOKEN_FILE", str(token))
    port = int(broker.url.rpartition(":")[2])
    file = tmp_path / "access.toml"
    async with Node("n") as node:
        await broker.stop()
        file.write_text(rules(OTHER))
        async with Broker(BrokerOptions(port=port, auth=file)) as again, asyncio.timeout(DEADLINE_SEC):
            while again.stats().unauthorized_connections < 3:
                await asyncio.sleep(0.01)
            assert not node.connected
            token.write_text(OTHER)
            while not node.connected:
                await asyncio.sleep(0.01)
    refusals = [record for record in caplog.records if "refuses this client" in record.getMessage()]
    assert len(refusals) == 1


async def test_an_inspector_presents_the_token(broker: Broker, monkeypatch: pytest.MonkeyPatch) -> None:
    """Without one it is refused with the same typed error as a node."""

    def count() -> int:
        with Inspector(broker.url, timeout_sec=DEADLINE_SEC) as inspector:
            return len(inspector.graph().nodes())

    with pytest.raises(NotAuthorized):
        await asyncio.to_thread(count)
    monkeypatch.setenv("CALLBOARD_TOKEN", TOKEN)
    assert await asyncio.to_thread(count) == 0


@pytest.mark.parametrize(
    ("command", "code"), [(["node", "list"], 3), (["topic", "echo", "/x"], 3), (["doctor"], 1)]
)
async def test_a_command_without_a_token_fails(
    broker: Broker, command: list[str], code: int, capfd: pytest.CaptureFixture[str]
) -> None:
    """The exit code of a broker that cannot be used, or doctor's, and the reason."""
    assert await asyncio.to_thread(main, command) == code
    shown = capfd.readouterr()
    assert "refuses this client" in shown.out + shown.err
