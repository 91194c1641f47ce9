"""Attacks on who may connect: without credentials, with wrong ones, too many, too often."""

from __future__ import annotations

import logging
from ipaddress import ip_address
from typing import TYPE_CHECKING

import pytest

from broker import Broker, BrokerOptions
from broker.access.admission import MAX_FAILURES, NOT_AUTHORIZED, PLAIN_TOKEN
from broker.access.credentials import hash_token
from broker.access.errors import AccessFileError
from broker.access.origin import Origin
from proto.errors import ErrorCode
from proto.limited_log import MAX_LINES
from proto.wire import frames
from tests.broker import frame_makers as make
from tests.broker.rawclient import RawClient, hello, link, until
from tests.system import change_origin

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

TOKEN = "cbt_" + "a" * 43
RULES = f"""
[users.robot]
tokens = ["{hash_token(TOKEN)}"]
roles = ["all"]

[roles.all]
allow.node = ["/**"]
"""


@pytest.fixture
def rules(tmp_path: Path, request: pytest.FixtureRequest) -> Path:
    """A file with one user, or with the parameter."""
    file = tmp_path / "access.toml"
    file.write_text(getattr(request, "param", RULES))
    return file


@pytest.fixture
def come_from(monkeypatch: pytest.MonkeyPatch) -> Callable[[str], None]:
    """Let further connections seem to come from an address."""

    def seem(address: str, *, encrypted: bool = False) -> None:
        change_origin(monkeypatch, Origin(address=ip_address(address), encrypted=encrypted))

    return seem


async def greet(broker: Broker, **options: frames.Scalar) -> frames.Error | None:
    """Send a HELLO; return the ERROR that answers it, None for WELCOME."""
    async with RawClient().connected(broker) as client:
        client.send(hello(**options))
        return await client.answer()


@pytest.mark.parametrize(
    "credentials", [{}, {"auth": "wrong"}, {"auth": ""}, {"auth": 7}, {"auth": b"x"}, {"auth": "x" * 2000}]
)
async def test_a_connection_without_valid_credentials_is_refused(
    rules: Path, credentials: dict[str, frames.Scalar]
) -> None:
    """With rules, loopback or not, a link needs a token; the text is the same whatever is wrong."""
    async with Broker(BrokerOptions(port=0, auth=rules)) as broker:
        error = await greet(broker, **credentials)
        assert error is not None
        assert error.code == ErrorCode.UNAUTHORIZED
        assert error.text == NOT_AUTHORIZED
        assert broker.stats().unauthorized_connections == 1
        assert await greet(broker, auth=TOKEN) is None


async def test_welcome_names_the_user(rules: Path) -> None:
    """A client learns whose rights it has."""
    async with Broker(BrokerOptions(port=0, auth=rules)) as broker, RawClient().connected(broker) as client:
        client.send(hello(auth=TOKEN))
        assert (await client.next(frames.Welcome)).options["user"] == "robot"


async def test_nothing_is_read_after_a_refusal(rules: Path) -> None:
    """Frames behind a HELLO that is refused have no effect."""
    async with Broker(BrokerOptions(port=0, auth=rules)) as broker:
        async with RawClient().connected(broker) as client:
            client.send(hello(), frames.Node(0, "/intruder"), frames.Watch(1, keep=False))
            assert (await client.next(frames.Error)).code == ErrorCode.UNAUTHORIZED
            await client.gone()
            assert client.waiting(frames.Graph) == []
        assert broker.stats().endpoints == 0


@pytest.mark.parametrize("rules", ['[local]\nuser = "robot"\n' + RULES], indirect=True)
async def test_local_connections_need_a_token_unless_the_rules_name_their_user(rules: Path) -> None:
    """`local.user` is whom connections from this machine belong to, but a wrong token is still wrong."""
    async with Broker(BrokerOptions(port=0, auth=rules)) as broker:
        assert await greet(broker) is None
        assert await greet(broker, auth="wrong") is not None


async def test_a_token_must_not_come_over_plain_tcp(rules: Path, come_from: Callable[..., None]) -> None:
    """From another machine a token needs TLS, or a broker that was told to take it."""
    async with Broker(BrokerOptions(port=0, auth=rules)) as broker:
        come_from("192.0.2.7")
        error = await greet(broker, auth=TOKEN)
        assert error is not None
        assert error.text == PLAIN_TOKEN
        come_from("192.0.2.7", encrypted=True)
        assert await greet(broker, auth=TOKEN) is None
    come_from("192.0.2.7")
    async with Broker(BrokerOptions(port=0, auth=rules, insecure=True)) as broker:
        assert await greet(broker, auth=TOKEN) is None
        assert await greet(broker) is not None


async def test_attempts_are_slowed_down(rules: Path, caplog: pytest.LogCaptureFixture) -> None:
    """After ten failures an address waits for the answer, except with a right token; the log has a sum."""
    options = BrokerOptions(port=0, auth=rules, handshake_timeout_sec=3.0)
    async with Broker(options) as broker:
        for _ in range(MAX_FAILURES):
            assert await greet(broker, auth="wrong") is not None
        async with RawClient().connected(broker) as client:
            client.send(hello(auth="wrong"))
            await until(lambda: broker.stats().unauthorized_connections == MAX_FAILURES + 1)
            assert client.waiting(frames.Error) == []
            assert await greet(broker, auth=TOKEN) is None
            assert (await client.next(frames.Error)).code == ErrorCode.UNAUTHORIZED
            await client.gone()
    lines = [record for record in caplog.records if record.levelno >= logging.WARNING]
    assert len(lines) == MAX_LINES + 1
    assert "127.0.0.1" in lines[0].getMessage()
    assert lines[-1].getMessage() == "… and 1 more like this: connections without valid credentials"


async def test_a_token_is_in_no_log_line_and_no_error(rules: Path, caplog: pytest.LogCaptureFixture) -> None:
    """Case 33: neither a right nor a wrong token appears in what the broker logs or answers."""
    caplog.set_level(logging.DEBUG)
    secret = "cbt_" + "s" * 43
    async with Broker(BrokerOptions(port=0, auth=rules), node_log_level=logging.INFO) as broker:
        error = await greet(broker, auth=secret)
        assert error is not None
        async with link(broker, "/n", auth=TOKEN) as client:
            client.send(frames.Ping(1), frames.Hello(1, {"auth": secret}))
            assert secret not in (await client.next(frames.Error)).text
        assert secret not in error.text
        assert hash_token(TOKEN) not in error.text
    shown = caplog.text
    assert shown
    for text in (secret, TOKEN, hash_token(TOKEN), hash_token(secret)):
        assert text not in shown


async def test_connections_of_one_address_are_limited(
    come_from: Callable[..., None], caplog: pytest.LogCaptureFixture
) -> None:
    """Cases 8 and 32: one address cannot take all connections; another one and this machine still get in."""
    options = BrokerOptions(port=0, max_connections_per_address=3, handshake_timeout_sec=60)
    async with Broker(options) as broker:
        come_from("192.0.2.7")
        held = [RawClient() for _ in range(3)]
        async with held[0].connected(broker), held[1].connected(broker), held[2].connected(broker):
            await until(lambda: broker.stats().connections == 3)
            async with RawClient().connected(broker) as client:
                error = await client.next(frames.Error)
                assert error.code == ErrorCode.LIMIT
                assert "--max-connections-per-address" in error.text
                await client.gone()
            assert (broker.stats().refused_connections, broker.stats().refused_per_address) == (1, 1)
            come_from("192.0.2.8")
            assert await greet(broker) is None
            come_from("127.0.0.1")
            for _ in range(5):
                assert await greet(broker) is None
            come_from("192.0.2.7")
        await until(lambda: broker.stats().connections == 0)
        assert await greet(broker) is None, "the ended ones do not count any more"
    assert "accepts at most 3 connections from one address (its --max-connections-per-address)" in caplog.text


FULL = "".join(
    f'allow.{word} = ["/**"]\n' for word in ("publish", "subscribe", "serve", "call", "see", "administer")
)
OTHER = "cbt_" + "o" * 43


@pytest.mark.parametrize("rules", [RULES + FULL], indirect=True)
async def test_a_reload_reaches_existing_sessions(rules: Path) -> None:
    """Case 23: a right that is revoked while subscribed ends the subscription, not the session."""
    async with (
        Broker(BrokerOptions(port=0, auth=rules)) as broker,
        link(broker, "/n", auth=TOKEN) as client,
        link(broker, "/talker", auth=TOKEN) as talker,
    ):
        client.send(make.subscription(1, "/t"), make.subscription(2, "/u"))
        talker.send(make.publisher(1, "/t"))
        publisher = (await talker.next(frames.Accepted)).number
        await client.next(frames.Attached)
        rules.write_text(RULES + FULL + 'deny.subscribe = ["/t"]\n')  # noqa: ASYNC240
        broker.reload()
        refused = await client.next(frames.Refused)
        assert (refused.id, refused.code) == (1, ErrorCode.DENIED)
        talker.send(make.batch(publisher, 0))
        await talker.synchronise()
        await client.synchronise()
        assert client.waiting(frames.Batch) == []
        assert broker.stats().endpoints == 4


@pytest.mark.parametrize("rules", [RULES + FULL], indirect=True)
async def test_what_waits_of_a_removed_user_is_not_delivered(rules: Path) -> None:
    """Case 23: messages that a reader has no credit for yet go with the session of their publisher."""
    two = RULES.replace("tokens = [", f'tokens = ["{hash_token(OTHER)}", ')
    rules.write_text(two + FULL)  # noqa: ASYNC240
    async with (
        Broker(BrokerOptions(port=0, auth=rules)) as broker,
        link(broker, "/talker", auth=TOKEN) as talker,
        link(broker, "/reader", auth=OTHER) as reader,
    ):
        reader.send(make.subscription(1, "/t", qos=make.KEEP_ALL, window=1))
        talker.send(make.publisher(1, "/t", qos={"depth": 5}))
        publisher = (await talker.next(frames.Accepted)).number
        await reader.next(frames.Attached)
        talker.send(make.batch(publisher, 0), make.batch(publisher, 1), make.batch(publisher, 2))
        assert (await reader.next(frames.Batch)).first_sequence == 0
        await talker.synchronise()
        rules.write_text(two.replace(f', "{hash_token(TOKEN)}"', "") + FULL)  # noqa: ASYNC240
        broker.reload()
        await talker.gone()
        await reader.next(frames.Detached)
        await reader.synchronise()
        assert reader.waiting(frames.Batch) == []
        assert broker.stats().dropped == 2


@pytest.mark.parametrize("left", ["token", "user"])
@pytest.mark.parametrize("rules", [RULES + FULL], indirect=True)
async def test_a_session_whose_credentials_are_gone_ends(rules: Path, left: str) -> None:
    """Case 23: neither a removed token nor a removed user keeps a session; others stay."""
    two = RULES.replace("tokens = [", f'tokens = ["{hash_token(OTHER)}", ')
    rules.write_text(two + FULL)  # noqa: ASYNC240
    async with (
        Broker(BrokerOptions(port=0, auth=rules)) as broker,
        link(broker, "/n", auth=TOKEN) as client,
        link(broker, "/o", auth=OTHER) as other,
    ):
        changed = two.replace(f', "{hash_token(TOKEN)}"', "")
        rules.write_text((changed if left == "token" else changed.replace("robot", "new")) + FULL)  # noqa: ASYNC240
        broker.reload()
        assert (await client.next(frames.Error)).code == ErrorCode.UNAUTHORIZED
        await client.gone()
        await other.synchronise()
        assert broker.stats().endpoints == 1


@pytest.mark.parametrize("content", ["", "users = 1", "[users.x]\nroles = ['none']", None])
@pytest.mark.parametrize("rules", [RULES + FULL], indirect=True)
async def test_a_bad_reload_keeps_the_old_rules(rules: Path, content: str | None) -> None:
    """Case 34: an empty, broken or missing file changes nothing, neither for sessions nor for newcomers."""
    async with Broker(BrokerOptions(port=0, auth=rules)) as broker, link(broker, "/n", auth=TOKEN) as client:
        rules.unlink()  # noqa: ASYNC240
        if content is not None:
            rules.write_text(content)  # noqa: ASYNC240
        with pytest.raises(AccessFileError):
            broker.reload()
        await client.synchronise()
        assert await greet(broker, auth=TOKEN) is None
        assert await greet(broker) is not None


@pytest.mark.parametrize(
    "rules", [RULES + 'allow.administer = ["/a/**"]\nallow.publish = ["/**"]'], indirect=True
)
async def test_statistics_need_a_right(rules: Path) -> None:
    """Case 22: INSPECT shows nothing of what a user may not administer, except its own link."""
    async with (
        Broker(BrokerOptions(port=0, auth=rules)) as broker,
        link(broker, "/a/n", auth=TOKEN) as one,
        link(broker, "/b/n", auth=TOKEN) as two,
    ):
        one.send(make.publisher(1, "/a/t"))
        two.send(make.publisher(1, "/b/t"), frames.Inspect(1))
        stats = [await two.next(frames.Stats)]
        while stats[-1].more:
            stats.append(await two.next(frames.Stats))
        assert {topic.name for each in stats for topic in each.topics} == {"/a/t"}
        assert {node for each in stats for link_ in each.links for node in link_.nodes} == {
            "/a/n",
            "/b/n",
        }
        assert not stats[0].totals["connections"]


@pytest.mark.parametrize("content", ["", "# empty", "users", "[users.a]\nroles = ['x']", None])
async def test_a_broken_file_opens_nothing(tmp_path: Path, content: str | None) -> None:
    """Case 34: an empty, broken or missing file keeps the broker from starting."""
    file = tmp_path / "access.toml"
    if content is not None:
        file.write_text(content)
    with pytest.raises(ValueError, match=r"access\.toml"):
        await Broker(BrokerOptions(port=0, auth=file)).__aenter__()


async def test_a_file_that_anybody_may_write_to_is_refused(rules: Path) -> None:
    """Rules that any local user can change protect nothing."""
    rules.chmod(0o666)  # noqa: ASYNC240
    with pytest.raises(ValueError, match="everybody may write to it"):
        await Broker(BrokerOptions(port=0, auth=rules)).__aenter__()
