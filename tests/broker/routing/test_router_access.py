"""Access rules in the router: declarations, what is seen, and what a change of the rules removes."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest

from broker.access.origin import LOCAL
from broker.access.parse import parse_rules
from proto.errors import ErrorCode, ProtocolError
from proto.wire import frames
from proto.wire.codes import NoticeKind, Status
from proto.wire.type_hash import hash_of
from tests.broker import frame_makers as make
from tests.broker.switch import Switch

if TYPE_CHECKING:
    from broker.access.rules import Action, Principal, Rights


def user(name: str = "robot", **allow: str) -> Principal:
    """Return a user with patterns by action, separated by blanks, and any node name."""
    rights = {"node": "/**", **allow}
    lines = [f"allow.{action} = {patterns.split()!r}" for action, patterns in rights.items()]
    text = f"[users.{name}]\nroles = ['r']\n[roles.r]\n" + "\n".join(lines)
    found = parse_rules(text, "rules.toml").principal(name, LOCAL)
    assert found is not None
    return found


NOTHING = user(node="")
EVERYTHING = user(publish="/**", subscribe="/**", serve="/**", call="/**", see="/**")


def refusal(switch: Switch, peer: int, declaration: frames.Frame) -> int | None:
    """Declare something; return the code with which it is refused, None if it is accepted."""
    switch.send(peer, declaration)
    answers = switch.read_all(peer)
    refused = [frame for frame in answers if isinstance(frame, frames.Refused)]
    return refused[0].code if refused else None


DECLARATIONS: dict[str, frames.Frame] = {
    "publish": make.publisher(1),
    "subscribe": make.subscription(1),
    "serve": make.service(1, "/t"),
    "call": make.client(1, "/t"),
}


# Case 22: no way around a denied name


@pytest.mark.parametrize("action", DECLARATIONS)
def test_a_declaration_needs_its_right(action: str) -> None:
    """Each kind needs its own action, on that name; the others do not help."""
    switch = Switch()
    others = {word: "/**" for word in (*DECLARATIONS, "see", "administer") if word != action}
    denied = switch.join("/n", principal=user(**others))
    assert refusal(switch, denied, DECLARATIONS[action]) == ErrorCode.DENIED
    wrong = switch.join("/o", principal=user(**{action: "/u /t/*"}))
    assert refusal(switch, wrong, DECLARATIONS[action]) == ErrorCode.DENIED
    allowed = switch.join("/p", principal=user(**{action: "/t"}))
    assert refusal(switch, allowed, DECLARATIONS[action]) is None


def test_a_node_name_needs_a_right_and_gives_none() -> None:
    """Case 24: a name that is not allowed is refused before it is known whether somebody has it."""
    switch = Switch()
    switch.join("/robot1/arm")
    peer = switch.join(principal=user(node="/robot2/*", publish="/robot2/**"))
    assert refusal(switch, peer, frames.Node(0, "/robot1/arm")) == ErrorCode.DENIED
    assert refusal(switch, peer, frames.Node(0, "/robot1/free")) == ErrorCode.DENIED
    assert refusal(switch, peer, frames.Node(0, "/robot2/arm")) is None
    assert refusal(switch, peer, make.publisher(1, "/robot1/t")) == ErrorCode.DENIED


def test_a_raw_subscription_needs_the_right_as_well() -> None:
    """Case 22: without a type it is still a subscription."""
    switch = Switch()
    peer = switch.join("/n", principal=user(subscribe="/u"))
    assert refusal(switch, peer, make.subscription(1, raw=True)) == ErrorCode.DENIED


def test_latched_messages_need_the_right() -> None:
    """Case 22: a refused subscription gets no replay."""
    switch = Switch()
    talker = switch.join("/talker")
    number = switch.publisher(talker, make.publisher(1, qos=make.LATCHED))
    switch.send(talker, make.batch(number, 0))
    peer = switch.join("/n", principal=user(subscribe="/u", see="/**"))
    switch.send(peer, make.subscription(1, qos=make.LATCHED), frames.Grant(1, number, 100, 1))
    assert {type(frame) for frame in switch.read_all(peer)} == {frames.Refused}


def test_a_denied_client_cannot_call() -> None:
    """Requests for it are answered as if there were no server."""
    switch = Switch()
    server = switch.join("/server")
    switch.send(server, make.service(1))
    peer = switch.join("/n", principal=user(call="/u"))
    switch.send(peer, make.client(2), make.request(2, 1))
    [reply] = switch.read(peer, frames.Reply)
    assert reply.entries[0].status == Status.UNAVAILABLE
    assert switch.read(server, frames.Request) == []


# What is seen


def seen(switch: Switch, peer: int, watch: int = 9) -> set[str]:
    """Return the nodes and names in a snapshot of the graph."""
    switch.send(peer, frames.Watch(watch, keep=False))
    entries = [entry for graph in switch.read(peer, frames.Graph) for entry in graph.added]
    return {entry.name or entry.node for entry in entries}


def populated() -> Switch:
    switch = Switch()
    one, two = switch.join("/robot1/arm"), switch.join("/robot2/arm")
    switch.send(one, make.publisher(1, "/robot1/pose"), make.publisher(2, "/shared"))
    switch.send(two, make.publisher(1, "/robot2/pose"), make.subscription(2, "/shared"))
    return switch


@pytest.mark.parametrize(
    ("patterns", "names"),
    [
        ("/**", {"/robot1/arm", "/robot2/arm", "/robot1/pose", "/robot2/pose", "/shared"}),
        ("/robot1/**", {"/robot1/arm", "/robot1/pose"}),
        ("/robot1/** /shared", {"/robot1/arm", "/robot1/pose", "/shared"}),
        ("/shared", set()),
        ("", set()),
    ],
)
def test_a_snapshot_has_what_the_user_may_see(patterns: str, names: set[str]) -> None:
    """An endpoint needs the right to see its name and its node's."""
    switch = populated()
    assert seen(switch, switch.join(principal=user(see=patterns))) == names


def test_changes_of_the_graph_are_filtered() -> None:
    """A watch is silent about what its user may not see, when it comes and when it goes."""
    switch = populated()
    limited, full = switch.join(principal=user(see="/robot1/**")), switch.join(principal=EVERYTHING)
    for peer in (limited, full):
        switch.send(peer, frames.Watch(1, keep=True))
        switch.read_all(peer)
    newcomer = switch.join("/robot3/arm")
    switch.send(newcomer, make.publisher(1, "/robot1/x"))
    switch.suspend(newcomer)
    switch.leave(newcomer)
    assert switch.read_all(limited) == []
    assert len(switch.read(full, frames.Graph)) == 4
    mate = switch.join("/robot1/leg")
    [graph] = switch.read(limited, frames.Graph)
    assert [entry.node for entry in graph.added] == ["/robot1/leg"]
    switch.leave(mate)
    [graph] = switch.read(limited, frames.Graph)
    assert graph.removed


def test_rights_are_evaluated_once_for_all_watches_that_share_them(monkeypatch: pytest.MonkeyPatch) -> None:
    """Thousand viewers with the same rights cost as much as one, except for the frames."""
    switch = Switch()
    same = user(see="/robot1/**")
    for _ in range(20):
        switch.send(switch.join(principal=same), frames.Watch(1, keep=True))
    asked: list[str] = []
    may = type(same.rights).may

    def counted(rights: Rights, action: Action, name: str) -> bool:
        asked.append(name)
        return may(rights, action, name)

    monkeypatch.setattr(type(same.rights), "may", counted)
    switch.join("/robot1/arm")
    assert asked == ["/robot1/arm"]


def test_a_definition_needs_a_visible_endpoint_of_its_type() -> None:
    """Case 22: DESCRIBE is answered as for an unknown type, until the user may see an endpoint of it."""
    switch = Switch()
    one = switch.join("/robot1/arm")
    secret = hash_of(b"secret")
    declaration = make.publisher(1, "/robot1/t")._replace(type_hash=secret, definition=b"secret")
    switch.send(one, declaration)
    limited = switch.join(principal=user(see="/robot2/**"))
    full = switch.join(principal=user(see="/robot1/**"))

    def described(peer: int) -> bytes | None:
        switch.send(peer, frames.Describe(secret))
        [answer] = switch.read(peer, frames.Definition)
        return answer.definition

    assert described(full) == b"secret"
    assert described(limited) is None
    two = switch.join("/robot2/arm")
    switch.send(two, make.subscription(1, "/robot2/t")._replace(type_hash=secret))
    assert described(limited) == b"secret", "a change of the graph counts at once"
    switch.leave(two)
    assert described(limited) is None


def test_a_notice_does_not_name_a_node_that_the_user_may_not_see() -> None:
    """Whose type differs is said only to who may see that node."""
    switch = Switch()
    secret = switch.join("/secret/node")
    switch.send(secret, make.publisher(1, type_hash="RIHS01_bb"))
    switch.read_all(secret)
    peer = switch.join("/n", principal=user(subscribe="/t", see="/t"))
    switch.send(peer, make.subscription(1))
    [notice] = switch.read(peer, frames.Notice)
    assert notice.kind == NoticeKind.INCOMPATIBLE_TYPE
    assert "/secret" not in notice.text
    [notice] = switch.read(secret, frames.Notice)
    assert "/n" in notice.text


def test_an_attachment_does_not_name_a_node_that_the_user_may_not_see() -> None:
    """A subscription that is allowed gets the messages, without the publisher's node."""
    switch = Switch()
    talker = switch.join("/secret/node")
    number = switch.publisher(talker, make.publisher(1))
    blind, seeing = (
        switch.join("/a", principal=user(subscribe="/t")),
        switch.join("/b", principal=EVERYTHING),
    )
    for peer, node in ((blind, ""), (seeing, "/secret/node")):
        switch.send(peer, make.subscription(1))
        [attached] = switch.read(peer, frames.Attached)
        assert attached.node == node
    switch.send(talker, make.batch(number, 0))
    assert len(switch.read(blind, frames.Batch)) == 1


# Case 23: the rules change


def test_a_revoked_subscription_gets_nothing_more() -> None:
    """Case 23: it is removed, with REFUSED; the publisher loses its reader and others keep theirs."""
    switch = Switch()
    talker = switch.join("/talker")
    number = switch.publisher(talker, make.publisher(1))
    peer, other = switch.join("/n", principal=EVERYTHING), switch.join("/o", principal=EVERYTHING)
    for each in (peer, other):
        switch.send(each, make.subscription(1), make.subscription(2, "/kept"))
        switch.read_all(each)
    switch.set_principal(peer, user(subscribe="/kept"))
    [refused] = switch.read(peer, frames.Refused)
    assert (refused.id, refused.code) == (1, ErrorCode.DENIED)
    assert "'robot' to subscribe to '/t'" in refused.text
    switch.send(talker, make.batch(number, 0))
    assert switch.read(peer, frames.Batch) == []
    assert len(switch.read(other, frames.Batch)) == 1
    assert refusal(switch, peer, make.subscription(1)) == ErrorCode.DENIED


def test_a_revoked_publisher_may_finish_what_it_has_sent() -> None:
    """Batches that crossed the REFUSED are dropped; those of a number it never had still end the session."""
    switch = Switch()
    listener = switch.join("/listener")
    switch.send(listener, make.subscription(1))
    peer = switch.join("/n", principal=EVERYTHING)
    number = switch.publisher(peer, make.publisher(1))
    switch.set_principal(peer, NOTHING)
    assert {frame.id for frame in switch.read(peer, frames.Refused)} == {0, 1}
    switch.send(peer, make.batch(number, 0), frames.Assert(number), frames.Undeclare(1))
    assert switch.read(listener, frames.Batch) == []
    with pytest.raises(ProtocolError, match="no publisher"):
        switch.send(peer, make.batch(number + 100, 0))


def test_a_revoked_node_takes_its_endpoints_along() -> None:
    """Nothing of it is left in the graph, and its name is free."""
    switch = Switch()
    peer = switch.join("/n", principal=EVERYTHING)
    switch.send(peer, make.publisher(1), make.service(2), make.client(3), make.subscription(4))
    switch.read_all(peer)
    switch.set_principal(peer, user(node="/other", publish="/**", serve="/**", call="/**", subscribe="/**"))
    assert sorted(frame.id for frame in switch.read(peer, frames.Refused)) == [0, 1, 2, 3, 4]
    assert len(switch.router.graph) == 0
    switch.join("/n")


@pytest.mark.parametrize("publisher", ["live", "suspended", "gone", "held back"])
@pytest.mark.parametrize("revoked", ["publish", "subscribe", ""])
@pytest.mark.parametrize("kind", [make.KEEP_ALL, make.LATCHED])
def test_a_revoked_right_holds_for_what_waits(publisher: str, revoked: str, kind: frames.Options) -> None:
    """Case 23: whatever became of the publisher, its messages and latched ones do not reach the reader."""
    switch = Switch()
    talker = switch.join("/talker", principal=EVERYTHING)
    reader = switch.join("/reader", principal=EVERYTHING)
    switch.send(reader, make.subscription(1, qos=kind, window=2))
    number = switch.publisher(talker, make.publisher(1, qos=kind))
    switch.send(talker, make.batch(number, 0), make.batch(number, 1))
    if kind is make.LATCHED:
        switch.send(reader, make.subscription(2, qos=kind))
    if publisher == "suspended":
        switch.suspend(talker)
    elif publisher == "gone":
        switch.leave(talker)
    elif publisher == "held back":
        switch.check_stalls(0.0, 61.0)
    denied = user(see="/**")
    switch.set_principal(
        reader if revoked == "subscribe" else talker,
        denied if revoked else EVERYTHING,
        denied if revoked == "publish" else None,
    )
    got = switch.read_all(reader)
    messages = [frame for frame in got if isinstance(frame, frames.Batch | frames.Replay)]
    assert bool(messages) == (not revoked)
    refused = any(isinstance(frame, frames.Refused) for frame in got)
    assert refused == (revoked == "subscribe")
    if revoked == "publish":
        assert any(isinstance(frame, frames.Detached) for frame in got)


def test_a_revoked_server_ends_its_calls() -> None:
    """Its callers get an answer."""
    switch = Switch()
    server, caller = switch.join("/server", principal=EVERYTHING), switch.join("/caller")
    switch.send(server, make.service(1))
    switch.send(caller, make.client(1), make.request(1, 7))
    switch.read_all(caller)
    switch.set_principal(server, NOTHING)
    [reply] = switch.read(caller, frames.Reply)
    assert reply.entries[0].status == Status.UNAVAILABLE


def test_rules_that_still_allow_change_nothing() -> None:
    """Nobody notices a reload that does not concern him."""
    switch = populated()
    peer = switch.join("/n", principal=EVERYTHING)
    switch.send(peer, make.publisher(1), make.subscription(2), frames.Watch(1, keep=True))
    switch.read_all(peer)
    again = user(publish="/**", subscribe="/**", serve="/**", call="/**", see="/**")
    assert again.rights != EVERYTHING.rights
    switch.set_principal(peer, again)
    assert switch.read_all(peer) == []


def test_a_kept_watch_follows_the_rules() -> None:
    """What its user may not see any more goes, what it may see now comes."""
    switch = populated()
    peer = switch.join(principal=user(see="/robot1/**"))
    switch.send(peer, frames.Watch(1, keep=True))
    [first] = switch.read(peer, frames.Graph)
    switch.set_principal(peer, user(see="/robot2/**"))
    changes = switch.read(peer, frames.Graph)
    assert {key for graph in changes for key in graph.removed} == {entry.key for entry in first.added}
    assert {entry.node for graph in changes for entry in graph.added} == {"/robot2/arm"}
    newcomer = switch.join("/robot1/leg")
    switch.leave(newcomer)
    assert switch.read_all(peer) == []


def test_a_reload_costs_a_link_what_the_link_has(monkeypatch: pytest.MonkeyPatch) -> None:
    """A link without a watch is not compared with the whole graph."""
    switch = populated()
    peer = switch.join("/n", principal=EVERYTHING)
    switch.send(peer, make.publisher(1))
    asked: list[str] = []
    again = user(publish="/**", see="/**")
    may = type(again.rights).may

    def counted(rights: Rights, action: Action, name: str) -> bool:
        asked.append(name)
        return may(rights, action, name)

    monkeypatch.setattr(type(again.rights), "may", counted)
    switch.set_principal(peer, again)
    assert sorted(asked) == ["/n", "/t"]


def test_another_user_cannot_take_over_a_link() -> None:
    """Case 26: even with the instance and the token of its HELLO."""
    switch = Switch()
    first = switch.join("/n", instance=b"i" * 16, principal=user("one", publish="/**"))
    switch.join(instance=b"i" * 16, principal=user("two", publish="/**"))
    assert switch.router.peer(first) is not None
    switch.join(instance=b"i" * 16, principal=user("one", publish="/**"))
    assert switch.router.peer(first) is None


@pytest.mark.parametrize("see", ["/talker /t", "/**"])
def test_a_stalled_reader_is_named_to_those_only_who_may_see_it(see: str) -> None:
    """§5.7.3: the NOTICE of a KEEP_ALL subscription that takes nothing is no way around hidden names."""
    switch = Switch()
    talker = switch.join("/talker", principal=user("talker", publish="/t", see=see))
    reader = switch.join("/reader", principal=EVERYTHING)
    switch.send(reader, make.subscription(1, qos=make.KEEP_ALL, window=1))
    number = switch.publisher(talker, make.publisher(1, qos=make.KEEP_ALL))
    switch.send(talker, make.batch(number, 0))
    switch.check_stalls(0.0, 61.0)
    (notice,) = switch.read(talker, frames.Notice)
    assert notice.kind == NoticeKind.STALLED
    assert ("/reader" in notice.text) == (see == "/**")
