"""Links: connecting, failing over, being turned away, and coming back."""

from __future__ import annotations

import asyncio
from typing import TYPE_CHECKING, Any, cast

import pytest

import actors
from actors.endpoints.endpoint import endpoint_of
from actors.interfaces.std_msgs.msg import String
from actors.session.link import Link
from broker import Broker, BrokerOptions
from proto import limits
from proto.errors import ErrorCode, ProtocolError
from proto.wire import frames
from proto.wire.codec import encode
from tests.actors.meeting import until
from tests.seams.nodes import connection_of, context_of, endpoints_of, link_of, unsent_publishers
from tests.simulation.loop import SimulatedLoop, simulate

if TYPE_CHECKING:
    from collections.abc import Awaitable, Callable
    from pathlib import Path

    from tests.actors.meeting import Meeting
    from tests.simulation.loop import SimulatedLoop

    ConnectionHandler = Callable[[asyncio.StreamReader, asyncio.StreamWriter], Awaitable[None]]

WELCOME = encode(frames.Welcome(limits.PROTOCOL_VERSION, {}))


class Impostor(asyncio.BufferedProtocol):
    """Stands where a broker should: says one thing when greeted, and may hang up."""

    def __init__(self, said: bytes, *, stays: bool = False) -> None:
        self.said = said
        self.stays = stays
        self.transport: asyncio.Transport | None = None

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        self.transport = cast("asyncio.Transport", transport)

    def get_buffer(self, sizehint: int) -> bytearray:
        return bytearray(4096)

    def buffer_updated(self, nbytes: int) -> None:
        assert self.transport is not None
        self.transport.write(self.said)
        self.said = b""
        if not self.stays:
            self.transport.close()


async def impostor(path: Path, said: bytes, *, stays: bool = False) -> asyncio.Server:
    """Let an impostor listen at a path."""
    loop = asyncio.get_running_loop()
    return await loop.create_unix_server(lambda: Impostor(said, stays=stays), str(path))


async def test_another_protocol_version_ends_the_node(tmp_path: Path) -> None:
    """A broker of another version: an error with code VERSION instead of trying for ever."""
    said = encode(frames.Error(ErrorCode.VERSION, "this broker speaks version 99"))
    server = await impostor(tmp_path / "old", said)
    with pytest.raises(ProtocolError, match="version 99") as caught:
        await actors.Node("n", url=f"callboard+unix://{tmp_path}/old").run()
    assert caught.value.code == ErrorCode.VERSION
    server.close()
    await server.wait_closed()


@pytest.mark.parametrize("said", [b"HTTP/1.1 400 Bad Request\r\n\r\n", b"\xc6\xff\xff\xff\xff", b""])
async def test_what_is_no_broker_counts_as_none(
    tmp_path: Path, caplog: pytest.LogCaptureFixture, said: bytes
) -> None:
    """Somebody else's server is no broker: the node keeps trying, and its connect timeout holds."""
    url = f"callboard+unix://{tmp_path}/web"
    server = await impostor(tmp_path / "web", said)
    with pytest.raises(actors.BrokerUnreachable, match="No broker at"):
        await actors.Node("n", url=url, connect_timeout_sec=0.05).run()
    caplog.clear()
    patient = asyncio.create_task(actors.Node("n", url=url).run())
    await until(lambda: "; waiting for one" in caplog.text)
    patient.cancel()
    await asyncio.wait({patient})
    server.close()
    await server.wait_closed()


@pytest.mark.parametrize("host", ["a..b", "x" * 80, "no-such-host.invalid"])
async def test_a_host_that_cannot_be_looked_up_counts_as_no_broker(host: str) -> None:
    """Whatever is wrong with a host's name, the node says that there is no broker."""
    node = actors.Node("n", url=f"callboard://{host}:7411", connect_timeout_sec=0.05)
    with pytest.raises(actors.BrokerUnreachable):
        await node.run()


async def test_the_next_of_several_brokers_is_tried(tmp_path: Path) -> None:
    """A comma list fails over in order, at first and after a loss."""
    first, second = tmp_path / "first", tmp_path / "second"
    url = f"callboard+unix://{first},callboard+unix://{second}"
    async with Broker(BrokerOptions(unix=second)) as spare, actors.Node("n", url=url) as node:
        await until(lambda: node.connected)
        assert spare.stats().connections == 1
        async with Broker(BrokerOptions(unix=first)) as main:
            channel = link_of(node).channel
            assert channel is not None
            channel.abort()
            await until(lambda: main.stats().connections == 1)
        await until(lambda: node.connected and spare.stats().connections == 1)


def test_a_broker_that_says_nothing_does_not_use_up_the_time_of_the_next() -> None:
    """With a deadline each broker has its share of the time. The link says who it is, at once."""

    async def main(loop: SimulatedLoop) -> float:
        mute = await loop.create_server(lambda: Impostor(b"", stays=True), "127.0.0.1", 7000)
        url = "callboard://127.0.0.1:7000,callboard://127.0.0.1:7001,callboard://127.0.0.1:7411"
        began = loop.time()
        async with (
            Broker(BrokerOptions(port=7411)) as spare,
            actors.Node("n", url=url, connect_timeout_sec=3, use_global_arguments=False) as node,
        ):
            took = loop.time() - began
            assert node.diagnostics().broker == spare.url == "callboard://127.0.0.1:7411"
        mute.close()
        return took

    assert 0.9 < simulate(main) < 1.1


async def test_everything_is_declared_again(meeting: Meeting) -> None:
    """Case 36: after a broker's restart node, endpoints and matches are as before, and ids go on."""
    node = await meeting.node("n")
    received: list[str] = []
    node.create_subscription(String, "chatter", lambda msg: received.append(msg.data))
    publisher = node.create_publisher(String, "chatter")
    await until(lambda: publisher.peers == 1)
    publisher.publish(String(data="before"))
    await until(lambda: received)
    await meeting.restart_broker()
    await until(lambda: publisher.peers == 0)
    await until(lambda: publisher.peers == 1)
    publisher.publish(String(data="after"))
    await until(lambda: len(received) == 2)
    assert received == ["before", "after"]
    assert await node.get_node_names() == ["n"]


async def test_waiting_is_reported_once_with_the_remedy(
    meeting: Meeting, caplog: pytest.LogCaptureFixture
) -> None:
    """A missing broker is reported once, with the command that starts one, and so is its return."""
    await meeting.node("n")
    caplog.clear()
    caplog.set_level("INFO", "callboard")
    await meeting.stop_broker()
    await until(lambda: "waiting for one" in caplog.text)
    await meeting.restart_broker()
    await until(lambda: "Connected to" in caplog.text)
    port = meeting.url.rsplit(":", 1)[1]
    assert caplog.text.count(f"Start one with: callboard broker --port {port}") == 1
    assert caplog.text.count("Connected to the broker") == 1


async def test_a_round_trip_needs_a_session(meeting: Meeting) -> None:
    """`round_trip` without a session, or one that breaks meanwhile, raises BrokerUnreachable."""
    node = await meeting.node("n")
    link = link_of(node)
    waiting = asyncio.create_task(link.round_trip())
    await asyncio.sleep(0)
    assert link.channel is not None
    link.channel.abort()
    with pytest.raises(actors.BrokerUnreachable):
        await waiting
    with pytest.raises(actors.BrokerUnreachable):
        await Link().round_trip()


def test_a_broker_that_hangs_up_at_once_is_not_stormed() -> None:
    """A session that ends as soon as it begins does not make the pauses short again."""

    async def main(loop: SimulatedLoop) -> int:
        made: list[Impostor] = []

        def make() -> Impostor:
            made.append(Impostor(WELCOME))
            return made[-1]

        server = await loop.create_server(make, "127.0.0.1", 7411)
        async with actors.Node("n", url="callboard://127.0.0.1:7411", use_global_arguments=False):
            await asyncio.sleep(60)
        server.close()
        return len(made)

    assert 30 <= simulate(main) <= 80


async def test_what_a_callback_sends_as_the_link_ends_is_queued(meeting: Meeting) -> None:
    """A link that ends later in the same read leaves nothing half collected, beside the queue's depth."""
    node = await meeting.node("echo")
    link, publisher = link_of(node), node.create_publisher(String, "out", 1)
    collected: list[int] = []

    def answer(msg: String) -> None:
        for _ in range(5):
            publisher.publish(msg)
        connection_of(node).frame_received(frames.Goodbye("the broker is stopping"))
        collected.append(unsent_publishers(link))
        assert (publisher.queued, publisher.dropped) == (1, 4)

    node.create_subscription(String, "in", answer, 10)
    source = node.create_publisher(String, "in", 10)
    await until(lambda: source.get_subscription_count() == 1)
    source.publish(String(data="go"))
    await until(lambda: collected == [0])
    assert context_of(node).callback_errors == 0


async def test_the_end_of_a_session_tells_each_endpoint_once(
    meeting: Meeting, monkeypatch: pytest.MonkeyPatch
) -> None:
    """One call to each endpoint, however many publishers are attached to it, and none for an attachment."""
    node = await meeting.node("n")
    publishers = [node.create_publisher(String, "t") for _ in range(3)]
    subscription = node.create_subscription(String, "t", lambda msg: None)
    await until(lambda: subscription.peers == 3)
    told: list[str] = []

    def noting(name: str, call: Callable[..., None]) -> Callable[..., None]:
        def noted(*args: Any, **kwargs: Any) -> None:
            told.append(name)
            call(*args, **kwargs)

        return noted

    for endpoint in endpoints_of(node):
        monkeypatch.setattr(endpoint, "session_ended", noting(endpoint.kind, endpoint.session_ended))
    reader = endpoint_of(subscription)
    monkeypatch.setattr(reader, "detached", noting("detached", reader.detached))
    link_of(node).lost()
    assert told == ["publisher"] * len(publishers) + ["subscription"]
    assert subscription.peers == 0


class Source:
    """Notes how many messages leave together.

    Attributes:
        flushed: How many, each time.
        published: Messages that wait.
    """

    def __init__(self) -> None:
        self.flushed: list[int] = []
        self.published = 0

    def flush_turn(self) -> None:
        """Let them leave."""
        self.flushed.append(self.published)
        self.published = 0


@pytest.mark.parametrize(
    ("flushed_in", "expected"),
    [
        ((), [1, 11]),
        ((5,), [1, 5, 7]),  # a flush in the middle of a turn ends one wait, and not all that follow
    ],
)
def test_references_wait_for_those_of_the_next_turn(flushed_in: tuple[int, ...], expected: list[int]) -> None:
    """The first leaves in its own turn; those of turns that follow at once leave together."""
    source = Source()

    async def publish(loop: SimulatedLoop) -> None:
        link = Link("")
        link.loop = loop
        for turn in range(12):
            source.published += 1
            link.flush_later(source, 1000)
            if turn in flushed_in:
                link.flush()
                source.published += 1
                link.flush_later(source, 1000)
            await asyncio.sleep(0)
        await asyncio.sleep(1)

    simulate(publish)
    assert source.flushed == expected
