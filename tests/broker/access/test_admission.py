"""Admission: connections per address, failures, and what a transport says about its other end."""

from __future__ import annotations

import socket
from ipaddress import ip_address
from typing import Any

import pytest

from broker.access import admission
from broker.access.admission import FAILURE_PERIOD_SEC, MAX_FAILURES, Admission
from broker.access.credentials import hash_token
from broker.access.errors import Unauthorized
from broker.access.origin import LOCAL, UNKNOWN, Origin
from broker.access.parse import parse_rules
from broker.access.transport import is_same_user, origin_of
from proto.aio.local_socket import local_name
from tests.seams.brokers import kept_addresses, kept_failures

RULES = parse_rules(f"[users.a]\ntokens = ['{hash_token('t')}']", "rules.toml")


def origin(address: str) -> Origin:
    return Origin(address=ip_address(address), encrypted=True)


def fail(gate: Admission, where: Origin, now: float) -> bool:
    """Fail once; return whether the answer is late."""
    with pytest.raises(Unauthorized) as caught:
        gate.identify(where, "wrong", now)
    return caught.value.late


def test_failures_count_by_address_and_for_a_while() -> None:
    """The eleventh within a minute is answered late; another address and a later minute are not."""
    gate = Admission(RULES, max_per_address=1, plain_tokens=False)
    assert [fail(gate, origin("192.0.2.1"), now) for now in range(MAX_FAILURES)] == [False] * MAX_FAILURES
    assert fail(gate, origin("192.0.2.1"), 10)
    assert not fail(gate, origin("192.0.2.2"), 10)
    assert not fail(gate, LOCAL, 10)
    assert not fail(gate, origin("192.0.2.1"), FAILURE_PERIOD_SEC + 1)
    assert gate.unauthorized == MAX_FAILURES + 4


def test_the_table_of_failures_is_limited(monkeypatch: pytest.MonkeyPatch) -> None:
    """An attacker with many addresses does not fill the broker's memory."""
    monkeypatch.setattr(admission, "MAX_FAILING_ADDRESSES", 5)
    gate = Admission(RULES, max_per_address=1, plain_tokens=False)
    for number in range(20):
        fail(gate, origin(f"192.0.2.{number}"), 0)
    assert kept_failures(gate) == 5


def test_a_connection_that_ends_frees_one_place() -> None:
    """The others of its address are still counted."""
    gate, where = Admission(None, max_per_address=2, plain_tokens=False), origin("192.0.2.1")
    assert not gate.enter(where)
    assert not gate.enter(where)
    gate.leave(where)
    assert not gate.enter(where)
    assert gate.enter(where)


def test_ended_connections_are_forgotten() -> None:
    """Nothing is kept of an address without connections."""
    gate = Admission(None, max_per_address=1, plain_tokens=False)
    where = origin("192.0.2.1")
    assert gate.enter(where) == ""
    assert "1 connections from one address" in gate.enter(where)
    gate.leave(where)
    gate.leave(where)
    assert kept_addresses(gate) == 0
    assert gate.enter(where) == ""


def test_an_ipv6_network_counts_as_one_address() -> None:
    """Case 8: a host with 2^64 addresses gets no further than one with a single one; its neighbours do."""
    gate = Admission(RULES, max_per_address=1, plain_tokens=False)
    assert gate.enter(origin("2001:db8::1")) == ""
    assert gate.enter(origin("2001:db8::ffff:2"))
    assert gate.enter(origin("2001:db8:0:1::1")) == ""
    for number in range(MAX_FAILURES):
        fail(gate, origin(f"2001:db8::{number}"), 0)
    assert fail(gate, origin("2001:db8::abcd"), 0)
    assert not fail(gate, origin("2001:db8:0:1::1"), 0)


def test_without_rules_everybody_comes_in() -> None:
    """No file, no user, no failure."""
    gate = Admission(None, max_per_address=1, plain_tokens=False)
    assert gate.identify(origin("192.0.2.1"), "anything", 0) is None
    assert gate.unauthorized == 0


def test_a_token_in_the_clear_is_a_failure() -> None:
    """It counts for its address although it may be right, unless the broker allows plain tokens."""
    clear = Origin(address=ip_address("192.0.2.1"))
    gate = Admission(RULES, max_per_address=1, plain_tokens=False)
    with pytest.raises(Unauthorized, match="plain TCP"):
        gate.identify(clear, "t", 0)
    assert (gate.unauthorized, kept_failures(gate)) == (1, 1)
    allowed = Admission(RULES, max_per_address=1, plain_tokens=True).identify(clear, "t", 0)
    assert allowed is not None
    assert allowed.user == "a"


def test_who_has_no_token_may_still_be_known() -> None:
    """By its machine, for example; a token that is no text is a wrong one even then."""
    rules = parse_rules(f"[users.a]\ntokens = ['{hash_token('t')}']\n[local]\nuser = 'a'", "rules.toml")
    gate = Admission(rules, max_per_address=1, plain_tokens=False)
    found = gate.identify(LOCAL, None, 0)
    assert found is not None
    assert found.user == "a"
    with pytest.raises(Unauthorized):
        gate.identify(LOCAL, 7, 0)
    assert gate.unauthorized == 1


class Tls:
    def getpeercert(self) -> dict[str, Any]:
        subject = ((("organizationName", "x"),), (("commonName", "robot"),))
        return {"subject": subject, "subjectAltName": (("DNS", "robot"), ("DNS", "robot.example.org"))}


class WithoutCertificate:
    def getpeercert(self) -> None:
        return None


class Socket:
    def __init__(self, family: int, user: int = 0, name: bytes | str = "/run/callboard.sock") -> None:
        self.family = family
        self.getsockname = lambda: name
        self._user = user

    def getsockopt(self, *_: int) -> bytes:
        return (1).to_bytes(4, "little") + self._user.to_bytes(4, "little") + bytes(4)


TCP = Socket(socket.AF_INET)


@pytest.mark.parametrize(
    ("info", "expected"),
    [
        ({"socket": Socket(socket.AF_UNIX), "peername": ""}, LOCAL),
        (
            {"socket": Socket(socket.AF_UNIX, name=local_name("::1", 7411)), "peername": ""},
            Origin(address=ip_address("::1")),
        ),
        ({"socket": TCP, "peername": ("192.0.2.1", 5)}, Origin(address=ip_address("192.0.2.1"))),
        ({"socket": TCP, "peername": ("::ffff:192.0.2.1", 5, 0, 0)}, Origin(address=ip_address("192.0.2.1"))),
        ({"socket": TCP, "peername": None}, UNKNOWN),
        ({"socket": None, "peername": ("robot", 5)}, UNKNOWN),
        (
            {"socket": TCP, "peername": ("192.0.2.1", 5), "ssl_object": WithoutCertificate()},
            Origin(address=ip_address("192.0.2.1"), encrypted=True),
        ),
        (
            {"socket": TCP, "peername": ("192.0.2.1", 5), "ssl_object": Tls()},
            Origin(
                address=ip_address("192.0.2.1"),
                encrypted=True,
                certificate_names=("robot", "robot.example.org"),
            ),
        ),
    ],
)
def test_a_transport_says_where_its_connection_comes_from(info: dict[str, Any], expected: Origin) -> None:
    """An address that cannot be read is never taken for this machine."""
    assert origin_of(info.get) == expected
    assert expected.local is (info["socket"] is not None and info["socket"].family == socket.AF_UNIX)


def test_another_user_of_the_machine_is_recognised(monkeypatch: pytest.MonkeyPatch) -> None:
    """Only the broker's own user and root may use its socket file, whatever the file's mode."""
    monkeypatch.setattr("os.geteuid", lambda: 1000)
    for user, same in ((1000, True), (0, True), (1001, False)):
        assert is_same_user({"socket": Socket(socket.AF_UNIX, user)}.get) is same
