"""False definitions of types, and junk ones, neither replace nor push out the real ones."""

from __future__ import annotations

import json

import pytest

from actors.graph.inspector import Inspector
from actors.interfaces.described import texts_of
from actors.interfaces.errors import InvalidMessageError
from actors.interfaces.message import definition
from actors.interfaces.std_msgs.msg import Int64, String
from broker.routing import definitions
from broker.routing.router import Router
from broker.routing.router_limits import RouterLimits
from proto.errors import ErrorCode
from proto.wire import frames
from proto.wire.type_hash import hash_of
from tests.actors.graph.test_inspector import WELCOME, listener
from tests.broker import frame_makers as make
from tests.broker.switch import Switch

REAL = b"the real definition"
HASH = hash_of(REAL)


def declared(number: int, content: bytes, type_hash: str = "") -> frames.Publisher:
    """Return a publisher's declaration with a definition."""
    return make.publisher(number, type_hash=type_hash or hash_of(content))._replace(definition=content)


def described(switch: Switch, peer: int, type_hash: str = HASH) -> bytes | None:
    """Ask for a definition."""
    switch.send(peer, frames.Describe(type_hash))
    (answer,) = switch.read(peer, frames.Definition)
    return answer.definition


def test_a_definition_with_another_hash_is_refused() -> None:
    """Case 57: the first definition seen for a hash wins only if it has that hash."""
    switch = Switch()
    liar, honest = switch.join("/liar"), switch.join("/honest")
    service = make.service(2, type_hash=HASH)._replace(definition=b"another false one")
    switch.send(liar, declared(1, b"a false one", HASH), service)
    assert [each.code for each in switch.read(liar, frames.Refused)] == [ErrorCode.MALFORMED] * 2
    assert described(switch, honest) is None
    switch.send(honest, declared(1, REAL))
    switch.send(liar, declared(1, b"a false one", HASH))
    assert described(switch, honest) == REAL
    assert switch.router.declarations.definitions.refused == 3


def test_junk_does_not_push_out_definitions_in_use() -> None:
    """Case 57: one link may define so many types; those of others stay."""
    switch = Switch(Router(limits=RouterLimits(max_definitions=3)))
    honest, junk = switch.join("/honest"), switch.join("/junk")
    switch.send(honest, declared(1, REAL))
    for number in range(5):
        switch.send(junk, declared(number + 1, b"junk %d" % number))
    refused = switch.read(junk, frames.Refused)
    assert [(each.id, each.code) for each in refused] == [(4, ErrorCode.LIMIT), (5, ErrorCode.LIMIT)]
    assert "--max-definitions" in refused[0].text
    assert described(switch, junk) == REAL
    assert len(switch.router.declarations.definitions) == 4


def test_definitions_of_one_link_are_limited_in_bytes() -> None:
    """Case 57: what several endpoints of a link declare counts once."""
    switch = Switch(Router(limits=RouterLimits(max_definition_bytes=len(REAL))))
    node = switch.join("/n")
    switch.send(node, *(declared(number, REAL) for number in range(1, 5)), declared(5, b"more"))
    (refused,) = switch.read(node, frames.Refused)
    assert refused.id == 5
    assert "--max-definition-bytes" in refused.text


def test_an_endpoint_is_declared_without_a_definition_that_has_no_space(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Case 57: a graph full of definitions refuses nobody, and keeps those that it has."""
    monkeypatch.setattr(definitions, "MAX_TOTAL_BYTES", len(REAL))
    switch = Switch()
    first, second = switch.join("/first"), switch.join("/second")
    switch.send(first, declared(1, REAL))
    switch.send(second, declared(1, b"more"), declared(2, REAL))
    assert switch.read(second, frames.Refused) == []
    assert described(switch, second, hash_of(b"more")) is None
    switch.send(first, frames.Undeclare(1))
    switch.send(second, frames.Undeclare(1))
    assert described(switch, second) == REAL


def test_a_definition_goes_with_the_last_endpoint_that_declared_it() -> None:
    """Case 57: undeclared, or lost with its link."""
    switch = Switch()
    one, other = switch.join("/one"), switch.join("/other")
    switch.send(one, declared(1, REAL), declared(2, REAL))
    switch.send(other, declared(1, REAL))
    switch.send(one, frames.Undeclare(1), frames.Undeclare(2))
    kept = switch.router.declarations.definitions
    assert described(switch, one) == REAL
    switch.router.disconnect(other)
    assert described(switch, one) is None
    assert (len(kept), kept.size_bytes) == (0, 0)


def test_an_inspector_believes_no_definition_with_another_hash() -> None:
    """Case 57: nor does it believe a broker."""
    from proto.wire.codec import encode  # noqa: PLC0415

    answer = encode(frames.Definition(HASH, b"a false one"))
    with listener(WELCOME, answer) as url, Inspector(url) as inspector:
        assert inspector.definition(HASH) is None
        inspector.close()


@pytest.mark.parametrize("name", ["data\nint64 forged", "\x1b[2J", "", "two words", 7, None])
def test_names_in_a_definition_cannot_forge_lines(name: object) -> None:
    """Case 60: neither those of fields, nor of types, nor of types of fields."""
    assert texts_of(definition(String)) == {"std_msgs/msg/String": "string data\n"}
    for path in ("name", "nested", "type"):
        whole = json.loads(definition(Int64))
        described = whole["type_description"]
        if path == "type":
            described["type_name"] = name
        elif path == "name":
            described["fields"][0]["name"] = name
        elif name:  # "" stands for a primitive type
            described["fields"][0]["type"]["nested_type_name"] = name
        else:
            continue
        with pytest.raises(InvalidMessageError, match="cannot be read"):
            texts_of(json.dumps(whole).encode())
