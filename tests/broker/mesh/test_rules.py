"""What access rules let other brokers know, and what their nodes may do."""

from __future__ import annotations

import pytest

from broker.access.errors import AccessFileError
from broker.access.parse import parse_rules
from broker.access.rules import Rights
from broker.mesh.messages import Direct
from proto.wire import frames
from proto.wire.type_hash import hash_of
from tests.broker import frame_makers as make
from tests.broker.mesh.network import Network

USERS = "[users.a]\nroles = []\n"
ROLE = 'allow.node = ["/**"]\nallow.{0} = ["/open/**"]\nallow.{1} = ["/open/**"]\n'


def rights(one: str = "publish", other: str = "subscribe") -> Rights:
    """Return rights to all node names, and to do two things with names under /open."""
    text = f"{USERS}[roles.fleet]\n{ROLE.format(one, other)}[mesh]\nimport = ['fleet']"
    found = parse_rules(text, "rules").imports
    assert found is not None
    return found


def matched(network: Network, topic: str) -> tuple[int, int]:
    """Return how often a new publisher of the first broker and a subscription of the second match."""
    a, b = network
    talker, listener = a.join(f"/talker{topic}"), b.join(f"/listener{topic}")
    a.publisher(talker, make.publisher(1, topic))
    b.send(listener, make.subscription(1, topic))
    network.settle()
    found = [[*peer.read(node, frames.Matched)] for peer, node in ((a, talker), (b, listener))]
    one, other = (each[-1].peers if each else 0 for each in found)
    return one, other


def test_other_brokers_know_what_is_exported_only() -> None:
    """The rest neither matches nor is in their graph."""
    network = Network()
    a, b = network
    a.mesh.set_rights(None, rights())
    assert matched(network, "/open/topic") == (1, 1)
    assert matched(network, "/closed/topic") == (0, 0)
    assert "/closed/topic" not in b.router.topics.by_name or not any(
        each.peer.mesh for each in b.router.topics.by_name["/closed/topic"].publishers.values()
    )


def test_what_is_not_exported_does_not_match_what_others_export() -> None:
    """A subscription that the publisher's broker does not know would wait for ever."""
    network = Network()
    _, b = network
    b.mesh.set_rights(None, rights())
    assert matched(network, "/closed/topic") == (0, 0)


def test_messages_that_only_unknown_subscriptions_would_get_are_not_wanted() -> None:
    """Also of those that the rules hide from now on."""
    network = Network()
    _, b = network
    listener = b.join("/listener")
    b.send(listener, make.subscription(1, "/closed/topic"))
    network.settle()
    assert b.topics == {"/closed/topic"}
    b.mesh.set_rights(None, rights())
    network.settle()
    assert b.topics == set()


def test_endpoints_of_a_node_that_is_not_exported_are_not_either() -> None:
    """Their node would be missing."""
    network = Network()
    a, _ = network
    a.mesh.set_rights(None, Rights((), "nothing"))
    assert matched(network, "/open/topic") == (0, 0)
    assert network.brokers[2].mesh.counts()["refused"] == 0


def test_nodes_of_other_brokers_do_what_is_imported_only() -> None:
    """What is refused is counted and logged, and nothing waits for it at either broker."""
    network = Network()
    _, b = network
    b.mesh.set_rights(rights(), None)
    assert matched(network, "/open/topic") == (1, 1)
    assert matched(network, "/closed/topic") == (0, 0)
    assert b.mesh.counts()["refused"] == 1
    assert b.warnings[-1][2] == "the access rules do not import '/closed/topic' (publish)"


def test_clients_that_are_not_exported_call_servers_of_their_own_broker_only() -> None:
    """A server elsewhere is none for them."""
    network = Network()
    a, b = network
    a.mesh.set_rights(None, rights("serve", "publish"))
    caller, server = a.join("/caller"), b.join("/server")
    a.send(caller, make.client(1, "/open/service"))
    b.send(server, make.service(1, "/open/service"))
    network.settle()
    a.send(caller, make.request(1, 5))
    network.settle()
    (reply,) = a.read(caller, frames.Reply)
    assert reply.entries[0].status != 0
    assert b.read(server, frames.Request) == []


@pytest.mark.parametrize(("topic", "answer"), [("/open/topic", b"definition"), ("/closed/topic", None)])
def test_definitions_are_sent_of_exported_types_only(topic: str, answer: bytes | None) -> None:
    """Also if a broker asks that cannot know the type from the graph."""
    network = Network()
    a, b = network
    a.mesh.set_rights(None, rights())
    declared = make.publisher(1, topic, type_hash=hash_of(b"definition"))
    a.publisher(a.join("/talker"), declared._replace(definition=b"definition"))
    network.settle()
    question = Direct(a.number, 1, 1, 0, frames.Describe(declared.type_hash))
    network.carry(b, question)
    answers = [message.frame for message in a.mesh.pop_messages() if isinstance(message, Direct)]
    assert answers == [frames.Definition(declared.type_hash, answer)]


@pytest.mark.parametrize("kind", ["imports", "exports"])
def test_changed_rules_hold_at_once(kind: str) -> None:
    """What is denied leaves the other side, what is allowed comes back, and messages arrive again."""
    network = Network()
    a, b = network
    talker, listener = a.join("/talker"), b.join("/listener")
    publisher = a.publisher(talker, make.publisher(1, "/closed"))
    b.send(listener, make.subscription(1, "/closed"))
    network.settle()
    b.read_all(listener)
    for allowed in (None, rights(), None):
        if kind == "imports":
            b.mesh.set_rights(allowed, None)
        else:
            a.mesh.set_rights(None, allowed)
        network.settle()
        network.beat()
        current = b.router.topics.by_name["/closed"].subscriptions.values()
        assert [each.peers for each in current if not each.peer.mesh] == [int(allowed is None)]
    a.send(talker, make.batch(publisher, 0))
    network.settle()
    assert len(b.read(listener, frames.Batch)) == 1


@pytest.mark.parametrize(
    ("mesh", "fault"),
    [
        ("import = ['nobody']", r"mesh.import\[0\]: there is no role 'nobody'"),
        ("export = 'fleet'", "mesh.export must be an array"),
        ("both = []", "mesh.'both' is not a known key here"),
        ("import = ['near']", "the role 'near' has 'from'"),
    ],
)
def test_unusable_rules_of_a_mesh_are_refused(mesh: str, fault: str) -> None:
    """The error names the place."""
    roles = "[roles.fleet]\n[roles.near]\nfrom = ['local']\n"
    with pytest.raises(AccessFileError, match=fault):
        parse_rules(f"{USERS}{roles}[mesh]\n{mesh}", "rules")
