"""A broker's files for TLS: errors at the start, and another certificate without a restart."""

from __future__ import annotations

import asyncio
import contextlib
import signal
import ssl
import sys
from typing import TYPE_CHECKING

import pytest
from cryptography.hazmat.primitives import serialization

import actors
from broker import AddressInUseError, Broker, BrokerOptions, InvalidOptionError, UnprotectedError
from proto.errors import TlsFileError
from proto.wire.url import BrokerUrl, parse_url
from tests.broker.rawclient import DEADLINE_SEC, until
from tests.certificates import Authority
from tests.seams.brokers import dispatcher_of
from tests.seams.limits import set_limits

if TYPE_CHECKING:
    from pathlib import Path

pytestmark = pytest.mark.usefixtures("patience")


@pytest.fixture
def authority(tmp_path: Path) -> Authority:
    """The broker's authority."""
    return Authority(tmp_path)


async def fault(options: BrokerOptions) -> str:
    """Return why a broker does not start."""
    with pytest.raises(TlsFileError) as caught:
        async with Broker(options):
            pass
    return str(caught.value)


async def test_files_that_are_missing_or_something_else(authority: Authority, tmp_path: Path) -> None:
    """The text names the file; nothing is asked on a terminal."""
    pair, other = authority.issue("127.0.0.1"), authority.issue("localhost")
    text = tmp_path / "text"
    text.write_text("no PEM")
    missing = tmp_path / "missing"
    key = serialization.load_pem_private_key(pair.key.read_bytes(), None)
    locked = tmp_path / "locked.key"
    locked.write_bytes(
        key.private_bytes(
            serialization.Encoding.PEM,
            serialization.PrivateFormat.PKCS8,
            serialization.BestAvailableEncryption(b"secret"),
        )
    )

    async def start(cert: Path = pair.certificate, key: Path = pair.key, ca: Path = authority.ca) -> str:
        return await fault(BrokerOptions(port=0, tls_cert=cert, tls_key=key, tls_client_ca=ca))

    assert await start(cert=missing) == f"Cannot read {missing}: No such file or directory"
    for files in ({"cert": tmp_path}, {"key": tmp_path}, {"ca": tmp_path}):
        assert await start(**files) == f"Cannot read {tmp_path}: not a regular file"
    assert await start(key=missing) == f"Cannot read {missing}: No such file or directory"
    assert await start(ca=missing) == f"Cannot read {missing}: No such file or directory"
    assert await start(cert=text) == f"{text} has no certificate in PEM format"
    assert await start(key=text) == f"{text} has no private key in PEM format"
    assert await start(ca=text) == f"{text} has no certificate in PEM format"
    assert "does not belong to the certificate" in await start(key=other.key)
    assert "protected by a passphrase" in await start(key=locked)


@pytest.mark.parametrize(
    ("names", "text"),
    [
        (["tls_cert"], "give both"),
        (["tls_key"], "give both"),
        (["tls_client_ca"], "needs tls_cert"),
        (["tls_cert", "tls_key", "unix"], "unix socket has no TLS"),
    ],
)
def test_options_that_do_not_go_together(names: list[str], text: str, tmp_path: Path) -> None:
    """Half a certificate is an error, not a broker without TLS."""
    with pytest.raises(InvalidOptionError, match=text):
        BrokerOptions(**dict.fromkeys(names, tmp_path))  # type: ignore[arg-type]


async def test_the_broker_of_a_port_in_use_is_found(
    authority: Authority, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A broker with TLS is recognised without a certificate."""
    set_limits(monkeypatch, probe_sec=DEADLINE_SEC)
    async with Broker(authority.options()) as broker:
        options = BrokerOptions(port=parse_url(broker.url).port)
        with pytest.raises(AddressInUseError, match=r"broker \(with TLS\) is already running"):
            async with Broker(options):
                pass


async def serial(url: BrokerUrl, authority: Authority) -> str:
    """Return the serial number of the certificate that new connections get."""
    context = ssl.create_default_context(cafile=authority.ca)
    _, writer = await asyncio.open_connection(url.host, url.port, ssl=context)
    try:
        return str(writer.get_extra_info("peercert")["serialNumber"])
    finally:
        writer.close()


@pytest.mark.processes
async def test_sighup_reads_the_files_again(authority: Authority) -> None:
    """New connections get the new certificate; a broken file keeps the old one, with one line in the log."""
    pair = authority.issue("127.0.0.1")
    process = await asyncio.create_subprocess_exec(
        *(sys.executable, "-m", "broker", "--port", "0"),
        *("--tls-cert", str(pair.certificate), "--tls-key", str(pair.key)),
        stdout=asyncio.subprocess.PIPE,
        stderr=asyncio.subprocess.PIPE,
        start_new_session=True,
    )
    assert process.stdout is not None
    assert process.stderr is not None
    try:
        async with asyncio.timeout(20):
            line = (await process.stdout.readline()).decode()
            url = parse_url(line.split()[-1])
            assert url.tls
            first = await serial(url, authority)
            authority.issue("127.0.0.1")
            process.send_signal(signal.SIGHUP)
            assert b"Reloaded: the certificate" in await process.stderr.readline()
            second = await serial(url, authority)
            assert second != first
            pair.key.write_text("")
            process.send_signal(signal.SIGHUP)
            report = (await process.stderr.readline()).decode()
            assert report.startswith("[ERROR]")
            assert f"everything remains as it was: {pair.key} has no private key" in report
            assert await serial(url, authority) == second
            process.terminate()
            assert await process.wait() == 0
    finally:
        if process.returncode is None:
            process.kill()


async def test_a_reload_takes_all_files_or_none(authority: Authority, tmp_path: Path) -> None:
    """If the key is broken, the new rules do not hold either."""
    rules = tmp_path / "access.toml"
    rules.write_text(RULES)
    pair = authority.issue("127.0.0.1")
    async with Broker(authority.options(pair, auth=rules)) as broker:
        before = dispatcher_of(broker).admission.rules
        rules.write_text(RULES.replace("camera", "lidar"))
        pair.key.write_text("")
        with pytest.raises(TlsFileError):
            broker.reload()
        assert dispatcher_of(broker).admission.rules is before


RULES = """
[users.camera]
certificates = ["camera"]
roles = ["all"]

[roles.all]
allow.node = ["/**"]
"""


async def test_a_certificate_names_the_user_of_the_access_rules(
    authority: Authority, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """With rules, too: the name in a verified certificate decides, and another name is nobody's."""
    rules = tmp_path / "access.toml"
    rules.write_text(RULES)
    async with Broker(authority.options(tls_client_ca=authority.ca, auth=rules)) as broker:
        for name, welcome in (("camera", True), ("stranger", False)):
            files = authority.files(authority.issue(common_name=name))
            for variable, path in zip(
                ("CALLBOARD_CA", "CALLBOARD_CERT", "CALLBOARD_KEY"), files, strict=True
            ):
                monkeypatch.setenv(variable, path)
            with contextlib.nullcontext() if welcome else pytest.raises(actors.NotAuthorized):
                async with actors.Node("camera", url=broker.url, connect_timeout_sec=10):
                    assert broker.stats().endpoints == 1


async def test_required_certificates_are_authentication(authority: Authority) -> None:
    """A broker that requires certificates may listen for other machines; TLS alone is not enough."""
    with pytest.raises(UnprotectedError, match="--tls-client-ca"):
        await Broker(authority.options(host="0.0.0.0")).__aenter__()
    async with Broker(authority.options(host="0.0.0.0", tls_client_ca=authority.ca)) as broker:
        assert broker.stats().connections == 0


async def test_a_removed_authority_counts_for_new_connections_and_a_removed_name_for_all(
    authority: Authority, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Case 23: a reload of the client authorities ends no session; that of the rules does."""
    rules, clients = tmp_path / "access.toml", tmp_path / "clients.pem"
    rules.write_text(RULES)
    clients.write_bytes(authority.ca.read_bytes())
    other = Authority(tmp_path, "other")
    files = authority.files(authority.issue(common_name="camera"))
    for variable, path in zip(("CALLBOARD_CA", "CALLBOARD_CERT", "CALLBOARD_KEY"), files, strict=True):
        monkeypatch.setenv(variable, path)
    async with (
        Broker(authority.options(tls_client_ca=clients, auth=rules)) as broker,
        actors.Node("camera", url=broker.url, connect_timeout_sec=10) as node,
    ):
        clients.write_bytes(other.ca.read_bytes())
        broker.reload()
        with pytest.raises(actors.CallboardError):
            async with actors.Node("late", url=broker.url, connect_timeout_sec=2):
                pass
        assert node.connected
        assert broker.stats().endpoints == 1
        rules.write_text(RULES.replace('"camera"]', '"lidar"]'))
        broker.reload()
        await until(lambda: broker.stats().endpoints == 0)
