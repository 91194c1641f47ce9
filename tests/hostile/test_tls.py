"""TLS: whoever is not who the other expects gets no session, and is told why in words."""

from __future__ import annotations

import asyncio
import contextlib
import logging
from typing import TYPE_CHECKING, Any

import pytest

import actors
from actors.errors import TlsFailed
from actors.graph.inspector import Inspector
from broker import Broker, BrokerOptions
from proto.errors import ErrorCode, ProtocolError
from proto.wire.tls import TlsFault, TlsFiles
from tests.broker.rawclient import GREETING_BYTES, read_error, stream, until
from tests.certificates import Authority, expired, not_yet_valid

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from tests.certificates import Pair

pytestmark = pytest.mark.usefixtures("patience")


def use(monkeypatch: pytest.MonkeyPatch, files: TlsFiles) -> None:
    """Let the clients of this test use these files."""
    for name, value in zip(("CALLBOARD_CA", "CALLBOARD_CERT", "CALLBOARD_KEY"), files, strict=True):
        monkeypatch.setenv(name, value)


async def failures(url: str) -> list[TlsFailed]:
    """Return the errors of an inspector and of a node that connect there."""

    def inspect() -> None:
        with Inspector(url):
            pass

    with pytest.raises(TlsFailed) as of_inspector:
        await asyncio.to_thread(inspect)
    return [of_inspector.value, await node_failure(url)]


async def node_failure(url: str) -> TlsFailed:
    """Return the error of a node that connects there."""
    while True:
        try:
            async with actors.Node("node", url=url, connect_timeout_sec=1):
                pytest.fail("it must not enter")
        except TlsFailed as error:
            return error
        except actors.BrokerUnreachable:  # the machine has paused during TLS
            pass


async def graph(url: str) -> Any:
    """Return the graph, as an inspector sees it."""

    def inspect() -> Any:
        with Inspector(url) as inspector:
            return inspector.graph()

    return await asyncio.to_thread(inspect)


@pytest.fixture
def ours(tmp_path: Path) -> Authority:
    """The authority of the broker."""
    return Authority(tmp_path, "ours")


@pytest.mark.parametrize(
    ("issue", "fault", "text"),
    [
        (lambda ours: ours.issue("127.0.0.1", **expired()), TlsFault.EXPIRED, "has expired: renew it"),
        (lambda ours: ours.issue("127.0.0.1", **not_yet_valid()), TlsFault.NOT_YET_VALID, "clocks"),
        (
            lambda ours: ours.issue("robot.example", "10.0.0.7"),
            TlsFault.WRONG_HOST,
            "is for robot.example, 10.0.0.7, not for 127.0.0.1",
        ),
    ],
    ids=["expired", "not yet valid", "wrong host"],
)
async def test_a_certificate_that_does_not_hold(
    ours: Authority,
    issue: Callable[[Authority], Pair],
    fault: TlsFault,
    text: str,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Case 41: the client refuses it and says what to do; the broker has no session and goes on."""
    use(monkeypatch, ours.files())
    async with Broker(ours.options(issue(ours))) as broker:
        for error in await failures(broker.url):
            assert error.fault is fault
            assert text in str(error)
        await until(lambda: not broker.stats().connections)
        assert broker.stats().tls_failures


async def test_an_unknown_authority(ours: Authority, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Case 41: a certificate of another authority, or of one that only we know, counts for nothing."""
    theirs = Authority(tmp_path, "theirs")
    async with Broker(ours.options()) as broker:
        for files, text in (
            (theirs.files(), f"not from an authority in {theirs.ca}"),
            (TlsFiles(), "unknown"),
        ):
            use(monkeypatch, files)
            for error in await failures(broker.url):
                assert error.fault is TlsFault.UNKNOWN_CA
                assert text in str(error)
                assert "CALLBOARD_CA" in str(error)


async def test_tls_to_a_plain_port(
    ours: Authority, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    """Case 6: a client with TLS says that the port has none, and names the other URL; the broker logs why."""
    use(monkeypatch, ours.files())
    async with Broker(BrokerOptions(port=0)) as broker:
        for error in await failures(broker.url.replace("callboard:", "callboards:")):
            assert error.fault is TlsFault.NO_TLS
            assert f"use {broker.url}" in str(error)
    assert "starts with 0x16, as TLS does; a broker needs --tls-cert" in caplog.text


async def test_plain_bytes_to_a_tls_port(ours: Authority, caplog: pytest.LogCaptureFixture) -> None:
    """Case 6: the broker answers a greeting without TLS in the clear, and the client names the other URL."""
    async with Broker(ours.options()) as broker:
        async with stream(broker) as (reader, writer):
            writer.write(GREETING_BYTES)
            error = await read_error(reader)
            assert error is not None
            assert error.code == ErrorCode.TLS_REQUIRED
        for failure in await failures(broker.url.replace("callboards:", "callboard:")):
            assert failure.fault is TlsFault.TLS_REQUIRED
            assert f"use {broker.url}" in str(failure)
    assert "TLS: a client without TLS" in caplog.text


@pytest.mark.parametrize(
    "data",
    [
        b"GET / HTTP/1.1\r\nHost: x\r\n\r\n",
        b"SSH-2.0-OpenSSH_9.6\r\n",
        b"\x16\x03\x01\xff\xff\x01",
        b"\x16" * 70,
    ],
)
async def test_other_bytes_to_a_tls_port(
    ours: Authority, data: bytes, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    """Case 6: whatever is no TLS closes its connection with one log line; others go on."""
    use(monkeypatch, ours.files())
    async with (
        Broker(ours.options(handshake_timeout_sec=2)) as broker,
        actors.Node("bystander", url=broker.url),
        stream(broker) as (reader, writer),
    ):
        writer.write(data)
        async with asyncio.timeout(10):
            with contextlib.suppress(ConnectionError):
                while await reader.read(100):
                    pass
        await until(lambda: broker.stats().connections == 1)
        assert (await graph(broker.url)).entries
    assert len([record for record in caplog.records if record.levelno == logging.WARNING]) == 1


async def test_failures_of_tls_cannot_fill_the_log(ours: Authority, caplog: pytest.LogCaptureFixture) -> None:
    """Case 6, often: ten lines, and the rest in one."""
    async with Broker(ours.options()) as broker:
        for _ in range(15):
            async with stream(broker) as (reader, writer):
                writer.write(b"\x16" * 70)
                with contextlib.suppress(ConnectionError):
                    while await reader.read(100):
                        pass
        await until(lambda: not broker.stats().connections)
    assert caplog.text.count(": TLS:") == 10
    assert "5 more like this: failures of TLS" in caplog.text


async def test_a_silent_client_has_as_long_as_without_tls(ours: Authority) -> None:
    """Cases 1, 2: a connection counts from the beginning, and is closed at the handshake's deadline."""
    async with Broker(ours.options(handshake_timeout_sec=0.2)) as broker:
        async with stream(broker) as (reader, writer):
            await until(lambda: broker.stats().connections == 1)
            assert not await reader.read()
        async with stream(broker) as (reader, writer):
            writer.write(b"\x16\x03\x01")
            assert not await reader.read()


async def test_mutual_tls(ours: Authority, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Case 41: only a client with a certificate of the right authority has a session."""
    theirs = Authority(tmp_path, "theirs")
    async with Broker(ours.options(tls_client_ca=ours.ca)) as broker:
        use(monkeypatch, ours.files())
        for error in await failures(broker.url):
            assert error.fault is TlsFault.CLIENT_CERTIFICATE_REQUIRED
            assert "CALLBOARD_CERT" in str(error)
        for pair in (theirs.issue(common_name="camera"), ours.issue(common_name="old", **expired())):
            use(monkeypatch, ours.files(pair))
            for error in await failures(broker.url):
                assert error.fault is TlsFault.CLIENT_CERTIFICATE_REFUSED
                assert str(pair.certificate) in str(error)
        use(monkeypatch, ours.files(ours.issue(common_name="camera")))
        async with actors.Node("camera", url=broker.url):
            assert (await graph(broker.url)).entries


async def test_a_refused_client_is_told_why(ours: Authority, monkeypatch: pytest.MonkeyPatch) -> None:
    """A limit is named after the handshake, although the broker refuses before it."""
    use(monkeypatch, ours.files())
    async with Broker(ours.options(max_connections=1)) as broker, actors.Node("first", url=broker.url):
        with pytest.raises(ProtocolError, match="accepts at most 1 connections"):
            await graph(broker.url)


async def test_a_node_waits_for_a_better_certificate(
    ours: Authority, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    """Without a time limit a node says once what is wrong, and connects when that is mended."""
    use(monkeypatch, ours.files())
    pair = ours.issue("127.0.0.1", **expired())
    async with Broker(ours.options(pair)) as broker, actors.Node("node", url=broker.url) as node:
        assert not broker.stats().endpoints
        ours.issue("127.0.0.1")
        broker.reload()
        async with asyncio.timeout(10):
            assert await node.get_node_names()
    warnings = [record.message for record in caplog.records if "has expired" in record.message]
    assert len(warnings) == 1
    assert "Trying again" in warnings[0]
