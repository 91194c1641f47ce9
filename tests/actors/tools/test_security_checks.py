"""What others could misuse is found: secrets that everybody can read, old certificates, open brokers."""

from __future__ import annotations

import asyncio
import errno
import socket
import time
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest

from actors.config.contexts import Context, Contexts, contexts_file
from actors.tools import security_checks
from actors.tools.certificates import expiries
from broker import Broker, BrokerOptions
from proto.wire.url import BrokerUrl, parse_url
from tests.certificates import Authority, expired

if TYPE_CHECKING:
    from actors.tools.check import Check

NOW = 1_800_000_000.0
DAY = 86_400

UTC_2049 = """\
-----BEGIN CERTIFICATE-----
MIIBMTCB2aADAgECAgEBMAoGCCqGSM49BAMCMAwxCjAIBgNVBAMMAXgwHhcNMjYw
MTAxMDAwMDAwWhcNNDkxMjMxMjM1OTU5WjAMMQowCAYDVQQDDAF4MFkwEwYHKoZI
zj0CAQYIKoZIzj0DAQcDQgAE382PgCzyLu/nbnDdSf5w0qm48OfQVLGdjnEYAx07
HS1J+zyhPHQKkbW+uzYD+KYlHZK6YgiRHA2/SLdk9i0CWqMsMCowCQYDVR0TBAIw
ADAdBgNVHQ4EFgQUfWNcLcHS0QgU2YQfTsXh7TzL2F8wCgYIKoZIzj0EAwIDRwAw
RAIgT1pnHxvnXKJT7G92UDyuOm5f1Bz2XWp4Io+iN5N+71wCIEzfr18ee1YMTS8b
ZINA04g22iLK+nobESwKdwkyqxMb
-----END CERTIFICATE-----
"""
"""Version 3, until the last second of 2049."""

GENERALIZED_2050 = """\
-----BEGIN CERTIFICATE-----
MIIBATCBqAIBATAKBggqhkjOPQQDAjAMMQowCAYDVQQDDAF4MCAXDTI2MDEwMTAw
MDAwMFoYDzIwNTAwMTAxMDAwMDAwWjAMMQowCAYDVQQDDAF4MFkwEwYHKoZIzj0C
AQYIKoZIzj0DAQcDQgAEBxIVGRB4UKO4hIxQQPO4wIL8evcXJQZBxAZa+1W8+VBM
2w+ZBcs9vigYtsOHtvlMEkNThe0CkbQLxI4wREsDpzAKBggqhkjOPQQDAgNIADBF
AiEA28rGfFoSyR+BNGNbOZ6syIQbYRnStwIpWfJHJ/wdqhACIDjxrjIL8OydLz7P
337z9zxFJJfEH72/3NbBXgid0SNS
-----END CERTIFICATE-----
"""
"""Version 1, until the first second of 2050."""


def verdicts(checks: list[Check]) -> list[tuple[str, str]]:
    """Return status and finding; whatever is not ok has a remedy."""
    assert all(check.remedy for check in checks if check.status != "ok")
    return [(check.status, check.finding) for check in checks]


def test_secrets_that_every_user_can_read_are_found(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The owner and a group may read a secret; others may neither read nor write it."""
    path = tmp_path / "token"
    path.write_text("k4Xy9")
    monkeypatch.setenv("CALLBOARD_TOKEN_FILE", str(path))
    found: dict[int, str] = {}
    for mode in (0o600, 0o640, 0o604, 0o602):
        path.chmod(mode)
        ((found[mode], text),) = verdicts(security_checks.client_files())
        assert str(path) in text
        assert "k4Xy9" not in text
    assert found == {0o600: "ok", 0o640: "ok", 0o604: "warn", 0o602: "warn"}


def test_token_files_of_contexts_are_checked(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The finding names the context; a broken file of contexts is another check's finding."""
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path))
    path = tmp_path / "token"
    path.write_text("k4Xy9")
    path.chmod(0o644)
    contexts = Contexts()
    contexts.add("robot", Context(url="callboard://robot", token_file=str(path)))
    contexts.add("lab", Context(url="callboard://lab"))
    contexts.save()
    ((status, text),) = verdicts(security_checks.client_files())
    assert (status, text) == ("warn", f"context 'robot': {path} can be read or written by every user")
    Path(contexts_file()).write_text("broken")
    assert security_checks.client_files() == []


def test_files_that_cannot_be_read_are_found(tmp_path: Path) -> None:
    """The finding names what refers to it, and is one printable line."""
    files = {"tls_key": str(tmp_path / "k\n")}, {"tls_cert": str(tmp_path / "c\n")}
    key, certificate = verdicts(security_checks.check_files(*files))
    assert key == ("fail", f"tls_key: {tmp_path}/k\\n cannot be read: No such file or directory")
    assert certificate[0] == "fail"
    assert "\n" not in certificate[1]
    (tmp_path / "broken").write_text("no certificate")
    ((status, text),) = verdicts(security_checks.check_files({}, {"tls_cert": str(tmp_path / "broken")}))
    assert (status, text.rpartition(": ")[2]) == ("fail", "it has no certificate in PEM format")


@pytest.mark.parametrize(
    ("left", "status", "text"),
    [
        (-1, "fail", "x has expired"),
        (0, "fail", "x has expired"),
        (29 * DAY, "warn", "x expires in 29 days"),
        (30 * DAY, "ok", "x is valid for 30 days"),
    ],
)
def test_certificates_that_expire_soon_are_found(left: float, status: str, text: str) -> None:
    """A month is enough to renew one."""
    assert verdicts([security_checks.check_expiry("x", NOW + left, NOW)]) == [(status, text)]


def test_the_first_certificate_to_expire_counts(tmp_path: Path) -> None:
    """Of the certificates in a file, among other things in it, the one that expires first is judged."""
    path = tmp_path / "chain.pem"
    path.write_text(UTC_2049 + "key\n" + GENERALIZED_2050)
    ((status, text),) = verdicts(security_checks.check_files({}, {"tls_cert": str(path)}))
    days = int((expiries(UTC_2049)[0] - time.time()) // DAY)
    assert (status, text) == ("ok", f"tls_cert: {path} is valid for {days} days")


def test_both_kinds_of_times_are_read() -> None:
    """Until 2049 a certificate has years of two digits, and afterwards of four."""
    assert expiries(UTC_2049 + GENERALIZED_2050) == [2_524_607_999.0, 2_524_608_000.0]


@pytest.mark.parametrize("cut", range(0, 60, 7))
def test_a_broken_certificate_is_no_traceback(cut: int) -> None:
    """Cut at any place it is a ValueError that says so."""
    head, body, tail = UTC_2049.partition("\n")
    with pytest.raises(ValueError, match=r"broken|base64|padding"):
        expiries(head + body + tail[:cut] + "-----END CERTIFICATE-----")


async def open_check(broker: Broker, url: BrokerUrl, ca: str = "") -> Check:
    """Check in a thread whether a broker is open to others."""
    return await asyncio.to_thread(security_checks.openness, url, broker.instance, 5, ca=ca)


async def test_a_broker_that_listens_on_all_addresses_is_open() -> None:
    """It is found through a loopback address, too; the finding names the address that others use."""
    own = next(iter(security_checks.own_addresses()), None)
    if own is None:
        pytest.skip("needs an address besides loopback")
    async with Broker(BrokerOptions(host="0.0.0.0", port=0, insecure=True)) as broker:
        port = parse_url(broker.url).port
        for host in ("127.0.0.1", own):
            check = await open_check(broker, BrokerUrl(host, port))
            assert check.status == "warn"
            assert check.finding == f"the broker lets in anybody who reaches callboard://{own}:{port}"
            assert "--auth" in check.remedy


async def test_a_broker_for_this_machine_is_not_open(tmp_path: Path) -> None:
    """Neither on a loopback address nor at a socket file."""
    for options in (BrokerOptions(port=0), BrokerOptions(unix=tmp_path / "s")):
        async with Broker(options) as broker:
            assert (await open_check(broker, parse_url(broker.url))).status == "ok"


@pytest.mark.skipif(not socket.has_ipv6, reason="needs IPv6")
async def test_a_broker_that_only_ipv6_reaches_is_open(monkeypatch: pytest.MonkeyPatch) -> None:
    """One address that lets strangers in is enough, whether or not the broker listens at the others."""
    # "::1" stands for an address that others reach: not every machine has one of IPv6.
    monkeypatch.setattr(security_checks, "own_addresses", lambda: ("127.0.0.2", "::1"))
    async with Broker(BrokerOptions(host="::1", port=0)) as broker:
        url = parse_url(broker.url)
        check = await open_check(broker, url)
    assert check.finding == f"the broker lets in anybody who reaches callboard://[::1]:{url.port}"


def test_this_machine_has_addresses_of_both_families(monkeypatch: pytest.MonkeyPatch) -> None:
    """Each family is asked for the address of its route; one without a route is left out."""
    routes = {socket.AF_INET: "10.0.0.7", socket.AF_INET6: "fd00::7"}

    class Routed(socket.socket):
        def connect(self, address: Any) -> None:
            if self.family not in routes:
                raise OSError(errno.ENETUNREACH, "no route")

        def getsockname(self) -> tuple[str, int]:
            return routes[self.family], 1

    monkeypatch.setattr(socket, "socket", Routed)
    assert security_checks.own_addresses() == ("10.0.0.7", "fd00::7")
    del routes[socket.AF_INET]
    assert security_checks.own_addresses() == ("fd00::7",)


async def test_a_broker_that_requires_certificates_is_not_open(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A stranger has no certificate, even if whoever checks has one; if TLS fails, nothing is known."""
    own = next(iter(security_checks.own_addresses()), None)
    if own is None:
        pytest.skip("needs an address besides loopback")
    authority = Authority(tmp_path)
    pair, client = authority.issue("127.0.0.1", own), authority.issue("client")
    monkeypatch.setenv("CALLBOARD_CA", str(authority.ca))
    monkeypatch.setenv("CALLBOARD_CERT", str(client.certificate))
    monkeypatch.setenv("CALLBOARD_KEY", str(client.key))
    for ca, certificate, status in (
        (None, pair, "warn"),
        (authority.ca, pair, "ok"),
        (None, authority.issue("localhost"), "skip"),
    ):
        options = authority.options(certificate, host="0.0.0.0", insecure=True, tls_client_ca=ca)
        async with Broker(options) as broker:
            url = parse_url(broker.url)._replace(host="127.0.0.1")
            assert (await open_check(broker, url, str(authority.ca))).status == status


def test_files_for_tls_are_checked(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The key of a client must be hidden; its certificate and the authority must be valid."""
    authority = Authority(tmp_path)
    client = authority.issue("client", **expired())
    client.key.chmod(0o644)
    monkeypatch.setenv("CALLBOARD_CA", str(authority.ca))
    monkeypatch.setenv("CALLBOARD_CERT", str(client.certificate))
    monkeypatch.setenv("CALLBOARD_KEY", str(client.key))
    assert [check.status for check in security_checks.client_files()] == ["warn", "fail", "ok"]


def test_the_certificate_of_a_broker_is_checked() -> None:
    """Its time is that of Python's ssl module; without TLS there is none."""
    assert security_checks.broker_certificate({}) == []
    (check,) = security_checks.broker_certificate({"notAfter": "Jan  1 00:00:00 2020 GMT"})
    assert check[:3] == ("certificates", "fail", "the broker's certificate has expired")
