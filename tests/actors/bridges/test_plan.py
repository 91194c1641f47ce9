"""What a bridge shows on each side."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest

from actors.bridges.graph import BRIDGE_LABEL, ORIGIN_LABEL, SideEndpoint, SideNode, origin_of
from actors.bridges.plan import EMPTY_PLAN, Mirror
from actors.bridges.report import Reason, Refusal
from actors.qos.profile import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from tests.actors.bridges.sides import (
    BOOL,
    CLIENT,
    HIDDEN_HISTORY,
    PUBLISHER,
    SERVICE,
    SET_BOOL,
    STRING,
    SUBSCRIPTION,
    Known,
    all_known,
    endpoint,
    planned,
    side,
)

if TYPE_CHECKING:
    from actors.bridges.plan import Plan, SidePlan
    from proto.wire.codes import EntryKind

LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
BEST_EFFORT = QoSProfile(depth=5, reliability=ReliabilityPolicy.BEST_EFFORT)


def shown(plan: SidePlan) -> set[tuple[str, EntryKind, str]]:
    """Return the mirrors of a side, without their QoS."""
    return {(each.node, each.kind, each.name) for each in plan.mirrors}


def refused(plan: Plan) -> dict[str, Reason]:
    """Return what is refused, by name."""
    return {each.name: each.reason for each in plan.refusals}


def test_nothing_is_planned_for_empty_sides() -> None:
    """Two empty graphs give the plan that shows nothing."""
    assert planned() == EMPTY_PLAN


@pytest.mark.parametrize("other", ["aaa_msgs/msg/First", "std_msgs/msg/Zebra"])
def test_a_type_that_crosses_is_kept_when_another_one_appears(other: str) -> None:
    """An endpoint with another type, on either side, does not end what both sides have."""
    reader, talker = endpoint("/reader", SUBSCRIPTION, "/t"), endpoint("/talker", PUBLISHER, "/t")
    wrong = endpoint("/wrong", PUBLISHER, "/t", other)
    for ours, theirs in ((side(reader, wrong), side(talker)), (side(reader), side(talker, wrong))):
        plan = planned(ours=ours, theirs=theirs)
        assert set(plan.theirs.intake) == {("/t", STRING)}
        assert refused(plan) == {"/t": Reason.SECOND_TYPE}


def test_a_subscription_to_every_type_takes_the_type_of_the_other_network() -> None:
    """As `topic echo` has one: it is shown there with the topic's type; without publishers not at all."""
    reader = endpoint("/tool", SUBSCRIPTION, "/chatter")._replace(type_name="")
    plan = planned(ours=side(reader), theirs=side(endpoint("/talker", PUBLISHER, "/chatter")))
    assert {(each.node, each.type_name) for each in plan.theirs.mirrors} == {("/tool", STRING)}
    assert set(plan.theirs.intake) == {("/chatter", STRING)}
    assert not planned(ours=side(reader)).theirs.mirrors


def test_nodes_of_the_other_network_appear_with_their_endpoints() -> None:
    """Each endpoint of a node of ROS has a mirror in callboard under the node's name."""
    talker = endpoint("/robot/talker", PUBLISHER, "/chatter", qos=HIDDEN_HISTORY)
    server = endpoint("/robot/talker", SERVICE, "/set")
    plan = planned(theirs=side(talker, server, endpoint("/ui", CLIENT, "/set"), nodes=("/quiet",)))
    assert shown(plan.ours) == {
        ("/robot/talker", PUBLISHER, "/chatter"),
        ("/robot/talker", SERVICE, "/set"),
        ("/ui", CLIENT, "/set"),
    }
    assert plan.ours.nodes == {"/robot/talker": "/robot/talker", "/ui": "/ui", "/quiet": "/quiet"}
    assert plan.theirs == EMPTY_PLAN.theirs
    assert not plan.refusals


def test_a_mirror_says_what_it_is_a_mirror_of() -> None:
    """A mirror has the name and node of its original."""
    plan = planned(theirs=side(endpoint("/talker", SERVICE, "/set")), namespace="/robot1")
    mirror = Mirror("/robot1/talker", SERVICE, "/robot1/set", SET_BOOL, None, "/set", "/talker")
    assert plan.ours.mirrors == {mirror}


def test_callboard_nodes_appear_if_they_have_endpoints_that_cross() -> None:
    """A callboard node without an endpoint that crosses is not shown in ROS."""
    plan = planned(side(endpoint("/talker", PUBLISHER, "/chatter"), nodes=("/quiet",)))
    assert plan.theirs.nodes == {"/talker": "/talker"}
    assert shown(plan.theirs) == {("/talker", PUBLISHER, "/chatter")}


def test_a_topic_is_received_while_both_ends_exist() -> None:
    """The intake has a topic of a side if it has a publisher there and a subscription on the other side."""
    publisher = endpoint("/talker", PUBLISHER, "/chatter", qos=HIDDEN_HISTORY)
    listener = endpoint("/listener", SUBSCRIPTION, "/chatter")
    plan = planned(side(listener), side(publisher))
    assert list(plan.theirs.intake) == [("/chatter", STRING)]
    assert not plan.ours.intake
    assert planned(side(publisher), side(listener)).ours.intake.keys() == {("/chatter", STRING)}
    assert not planned(side(), side(publisher)).theirs.intake
    assert not planned(side(listener), side()).theirs.intake
    assert not planned(side(publisher, listener), side()).ours.intake


def test_the_subscription_that_receives_has_the_qos_of_the_intake() -> None:
    """A mirror subscription follows the publishers of its side, not the original."""
    listener = endpoint("/listener", SUBSCRIPTION, "/scan")
    plan = planned(side(listener), side(endpoint("/lidar", PUBLISHER, "/scan", qos=BEST_EFFORT)))
    (mirror,) = plan.theirs.mirrors
    assert mirror.qos == plan.theirs.intake["/scan", STRING][-1]
    assert mirror.qos is not None
    assert mirror.qos.reliability is ReliabilityPolicy.BEST_EFFORT
    alone = planned(side(listener))
    (mirror,) = alone.theirs.mirrors
    assert mirror.qos is not None
    assert mirror.qos.reliability is ReliabilityPolicy.RELIABLE


def test_latched_topics_are_named_while_nobody_needs_them() -> None:
    """A subscription that has received latched messages may stay: the plan says for which topics."""
    publisher = endpoint("/map_server", PUBLISHER, "/map", qos=LATCHED)
    alone = planned(theirs=side(publisher))
    assert alone.theirs.latched.keys() == {("/map", STRING)}
    needed = planned(side(endpoint("/ui", SUBSCRIPTION, "/map")), side(publisher))
    assert needed.theirs.latched == {}
    assert needed.theirs.intake == alone.theirs.latched
    volatile = endpoint("/talker", PUBLISHER, "/chatter")
    assert not planned(theirs=side(volatile)).theirs.latched


def test_a_mirror_is_never_mirrored() -> None:
    """Nodes with an origin and their endpoints stay on their side, also if a native node shares the name."""
    mirror = SideNode("/talker", "ros2/7")
    foreign = SideEndpoint("/talker", PUBLISHER, "/chatter", STRING, "", LATCHED, "ros2/7")
    listener = endpoint("/listener", SUBSCRIPTION, "/chatter")
    for graph in (side(foreign, nodes=(mirror,)), side(foreign, nodes=(mirror, "/talker"))):
        assert not planned(graph).theirs.mirrors
        assert not planned(graph, side(listener)).ours.intake
        assert not planned(theirs=graph).ours.mirrors
    # An edge that does not know the origin of endpoints gives those of native nodes only.
    unmarked = endpoint("/talker", PUBLISHER, "/chatter")
    assert planned(side(unmarked, nodes=(mirror,))) == EMPTY_PLAN


def test_control_nodes_of_bridges_are_not_native() -> None:
    """The labels of mirrors and of control nodes give a node an origin, other labels do not."""
    assert origin_of({ORIGIN_LABEL: "ros2/7"}) == "ros2/7"
    assert origin_of({BRIDGE_LABEL: "ros2/8", "bridge_id": "a"}) == "ros2/8"
    assert not origin_of({"role": "bridge"})


def test_like_endpoints_of_a_node_have_one_mirror() -> None:
    """Two publishers of a node on one topic are one mirror, which offers the best of both."""
    first = endpoint("/node", PUBLISHER, "/t", qos=LATCHED)
    second = endpoint("/node", PUBLISHER, "/t", qos=BEST_EFFORT)
    (mirror,) = planned(side(first, second)).theirs.mirrors
    assert mirror.qos is not None
    assert mirror.qos.reliability is ReliabilityPolicy.RELIABLE
    assert mirror.qos.durability is DurabilityPolicy.TRANSIENT_LOCAL


def test_a_service_of_both_sides_does_not_cross() -> None:
    """If both sides serve a name, neither servers nor clients have mirrors; it is refused once, by name."""
    here = side(endpoint("/a", SERVICE, "/set"), endpoint("/c", CLIENT, "/set"))
    there = side(endpoint("/b", SERVICE, "/set"), endpoint("/d", CLIENT, "/set"))
    plan = planned(here, there)
    assert not plan.ours.mirrors
    assert not plan.theirs.mirrors
    assert [*map(str, plan.refusals)] == [
        "'/set' does not cross: both sides have a server of /set: each side keeps its own"
    ]


def test_an_action_of_both_sides_does_not_cross() -> None:
    """An action that both sides serve is refused as a whole: its topics do not cross either."""

    def action(node: str) -> list[SideEndpoint]:
        return [
            endpoint(node, SERVICE, "/fib/_action/send_goal", "p/action/Fib_SendGoal"),
            endpoint(node, PUBLISHER, "/fib/_action/feedback", "p/action/Fib_FeedbackMessage"),
        ]

    plan = planned(side(*action("/a")), side(*action("/b")))
    assert not plan.ours.mirrors
    assert not plan.theirs.mirrors
    assert refused(plan) == {"/fib": Reason.SERVED_TWICE}
    alone = planned(
        side(*action("/a")),
        side(endpoint("/b", SUBSCRIPTION, "/fib/_action/feedback", "p/action/Fib_FeedbackMessage")),
    )
    assert len(alone.theirs.mirrors) == 2


def test_services_of_two_nodes_of_one_name_are_no_news() -> None:
    """Parameter services of nodes of one name are refused quietly, and the name is not."""
    name = "/talker/get_parameters"
    plan = planned(
        side(endpoint("/talker", SERVICE, name), nodes=(SideNode("/talker", shared=False),)),
        side(endpoint("/talker", SERVICE, name)),
    )
    assert {each.name: each.quiet for each in plan.refusals} == {"/talker": False, name: True}


def test_names_of_nodes_that_are_taken() -> None:
    """A mirror gets a suffix where its name is taken, and shares the name of a node that shares it."""
    here = side(nodes=(SideNode("/a", shared=False), SideNode("/a_ros2", shared=False), SideNode("/b")))
    there = side(nodes=("/a", "/b", "/c"))
    plan = planned(here, there)
    assert plan.ours.nodes == {"/a_ros2_ros2": "/a", "/b": "/b", "/c": "/c"}
    (refusal,) = plan.refusals
    assert refusal.reason is Reason.NAME_TAKEN
    text = "/a appears as /a_ros2_ros2: a callboard node has its name and does not share it"
    assert str(refusal) == text
    publisher = endpoint("/c", PUBLISHER, "/chatter")
    assert planned(side(publisher), there).theirs.nodes == {"/c_callboard": "/c"}
    # Its own mirrors are no reason to choose another name.
    assert planned(side(publisher), side(nodes=(SideNode("/c", "me"),))).theirs.nodes == {"/c": "/c"}


def test_a_mirror_leaves_the_name_to_a_node_that_restarts() -> None:
    """A mirror with another name keeps it while its original is there, and so the name stays free."""
    there = side(nodes=("/a",))
    plan = planned(side(nodes=(SideNode("/a", shared=False),)), there)
    again = planned(side(), there, before=plan)
    assert again == plan
    gone = planned(side(), side(), before=again)
    assert planned(side(), there, before=gone).ours.nodes == {"/a": "/a"}
    robot = planned(side(), there, before=planned(side(), there, namespace="/r"), namespace="/r")
    assert robot.ours.nodes == {"/r/a": "/a"}


def test_two_mirrors_never_have_one_name() -> None:
    """If a name with its suffix is also the name of another node, that node keeps it."""
    here = side(nodes=(SideNode("/a", shared=False),))
    plan = planned(here, side(nodes=("/a", "/a_ros2")))
    assert plan.ours.nodes == {"/a_ros2": "/a_ros2", "/a_ros2_ros2": "/a"}


def test_namespace() -> None:
    """Names of ROS are below the namespace in callboard; only what is below it crosses the other way."""
    here = side(
        endpoint("/robot1/planner", PUBLISHER, "/robot1/cmd"),
        endpoint("/ui", SUBSCRIPTION, "/robot1/odom"),
        endpoint("/ui", PUBLISHER, "/robot2/cmd"),
        endpoint("/ui", PUBLISHER, "/rosout"),
        endpoint("/ui", PUBLISHER, "/robot1/rosout"),
    )
    there = side(
        endpoint("/base", SUBSCRIPTION, "/cmd"),
        endpoint("/base", PUBLISHER, "/odom"),
        endpoint("/base", PUBLISHER, "/rosout"),
        endpoint("/base", PUBLISHER, "/clock"),
    )
    plan = planned(here, there, namespace="/robot1")
    assert shown(plan.theirs) == {
        ("/planner", PUBLISHER, "/cmd"),
        ("/ui", SUBSCRIPTION, "/odom"),
        ("/ui", PUBLISHER, "/rosout"),
    }
    assert shown(plan.ours) == {
        ("/robot1/base", SUBSCRIPTION, "/robot1/cmd"),
        ("/robot1/base", PUBLISHER, "/robot1/odom"),
        ("/robot1/base", PUBLISHER, "/rosout"),
        ("/robot1/base", PUBLISHER, "/robot1/clock"),
    }
    assert plan.theirs.intake.keys() == {("/odom", STRING)}
    assert plan.ours.intake.keys() == {("/robot1/cmd", STRING)}


def test_nodes_that_would_have_one_name_without_the_namespace() -> None:
    """The node inside the namespace has the exact name, the one outside a suffix."""
    here = side(
        endpoint("/robot1/ui", PUBLISHER, "/robot1/a"),
        endpoint("/ui", PUBLISHER, "/robot1/a"),
    )
    assert planned(here, namespace="/robot1").theirs.nodes == {"/ui": "/robot1/ui", "/ui_callboard": "/ui"}


def test_rules_hide_endpoints_on_both_sides() -> None:
    """What the rules do not allow has no mirror, is not received and is no refusal."""
    here = side(endpoint("/ui", SUBSCRIPTION, "/camera/raw"), endpoint("/ui", SUBSCRIPTION, "/camera/small"))
    there = side(endpoint("/cam", PUBLISHER, "/camera/raw"), endpoint("/cam", PUBLISHER, "/camera/small"))
    plan = planned(here, there, deny=("/camera/raw",))
    assert shown(plan.ours) == {("/cam", PUBLISHER, "/camera/small")}
    assert shown(plan.theirs) == {("/ui", SUBSCRIPTION, "/camera/small")}
    assert plan.theirs.intake.keys() == {("/camera/small", STRING)}
    assert not plan.refusals


def test_nodes_of_which_nothing_may_cross_are_hidden() -> None:
    """A ROS node whose endpoints are all denied is hidden, and its log lines do not cross either."""
    secret = [
        endpoint("/secret", PUBLISHER, "/secret/plan"),
        endpoint("/secret", PUBLISHER, "/rosout"),
    ]
    there = side(*secret, endpoint("/open", PUBLISHER, "/rosout"), nodes=("/quiet",))
    plan = planned(side(endpoint("/log", SUBSCRIPTION, "/rosout")), there, deny=("/secret/**",))
    assert plan.ours.nodes.keys() == {"/open", "/quiet"}
    assert shown(plan.ours) == {("/open", PUBLISHER, "/rosout")}
    only_secret = planned(
        side(endpoint("/log", SUBSCRIPTION, "/rosout")), side(*secret), deny=("/secret/**",)
    )
    assert not only_secret.theirs.intake


def test_a_type_that_a_side_lacks() -> None:
    """A type that one side lacks is refused by name, quietly if only callboard can have it."""

    def known(name: str) -> Known:
        return Known() if name == STRING else Known(reason=f"install {name}")

    here = side(
        endpoint("/a", PUBLISHER, "/ok"),
        endpoint("/a", PUBLISHER, "/bool", BOOL),
        endpoint("/a", PUBLISHER, "/own", "callboard_interfaces/msg/X"),
    )
    plan = planned(here, side(endpoint("/b", PUBLISHER, "/odd", "odd_msgs/msg/Odd")), known)
    assert shown(plan.theirs) == {("/a", PUBLISHER, "/ok")}
    assert not plan.ours.mirrors
    assert plan.refusals == (
        Refusal("/bool", Reason.TYPE_MISSING, f"install {BOOL}", BOOL),
        Refusal("/odd", Reason.TYPE_MISSING, "install odd_msgs/msg/Odd", "odd_msgs/msg/Odd"),
        Refusal(
            "/own",
            Reason.TYPE_MISSING,
            "install callboard_interfaces/msg/X",
            "callboard_interfaces/msg/X",
            quiet=True,
        ),
    )


def test_an_endpoint_with_another_hash() -> None:
    """An endpoint with another definition of its type is refused, with both hashes; others still cross."""

    def known(_: str) -> Known:
        return Known(our_hash="mine")

    graph = side(
        endpoint("/old", PUBLISHER, "/t", type_hash="older"),
        endpoint("/new", PUBLISHER, "/t", type_hash="mine"),
        endpoint("/unknown", PUBLISHER, "/t"),
    )
    for plan in (planned(graph, known=known), planned(theirs=graph, known=known)):
        assert {each.node for each in plan.ours.mirrors | plan.theirs.mirrors} == {"/new", "/unknown"}
        (refusal,) = plan.refusals
        assert refusal.reason is Reason.TYPE_DIFFERS
        assert "older" in refusal.text
        assert "mine" in refusal.text


def test_names_of_other_networks_are_made_printable() -> None:
    """A refusal may quote what no broker would accept: it is escaped and cut."""
    name, type_name = "/t\x1b[2J", "a\n" * 1000
    known = Known(reason=f"install {type_name}")
    graph = side(endpoint("/a", PUBLISHER, name), endpoint("/a", PUBLISHER, "/t", type_name))
    refusals = planned(theirs=graph, known=lambda _: known).refusals
    assert len(refusals) == 2
    for text in (*(str(each) for each in refusals), *(each.type_name for each in refusals)):
        assert text.isprintable()
        assert len(text) < 1000


def test_a_type_with_two_definitions() -> None:
    """If both sides have a type and it cannot cross, the definitions differ."""
    known = Known("hashes", "1", "2")
    plan = planned(side(endpoint("/a", SERVICE, "/set")), known=lambda _: known)
    assert refused(plan) == {"/set": Reason.TYPE_DIFFERS}


def test_one_type_of_a_topic_crosses() -> None:
    """A topic crosses with one type: one that ROS has itself, or else the first by name."""
    strings, bools = endpoint("/a", PUBLISHER, "/t", STRING), endpoint("/b", PUBLISHER, "/t", BOOL)
    plan = planned(side(strings, bools))
    assert {each.type_name for each in plan.theirs.mirrors} == {BOOL}
    assert refused(plan) == {"/t": Reason.SECOND_TYPE}
    plan = planned(side(strings, bools), side(endpoint("/c", SUBSCRIPTION, "/t", STRING)))
    assert {each.type_name for each in plan.theirs.mirrors} == {STRING}
    # A type that cannot cross is no reason to refuse another.
    plan = planned(side(strings, bools), known=lambda name: Known("no" if name == BOOL else ""))
    assert {each.type_name for each in plan.theirs.mirrors} == {STRING}


def test_time_has_one_source() -> None:
    """/clock crosses from one publisher; a second one is reported, and so are clocks on both sides."""
    second = side(endpoint("/sim", PUBLISHER, "/clock"), endpoint("/bag", PUBLISHER, "/clock"))
    plan = planned(theirs=second)
    assert shown(plan.ours) == {("/bag", PUBLISHER, "/clock")}
    assert refused(plan) == {"/clock": Reason.SECOND_CLOCK}
    both = planned(side(endpoint("/own", PUBLISHER, "/clock")), second)
    assert not both.ours.mirrors
    assert refused(both) == {"/clock": Reason.SECOND_CLOCK}


def test_a_name_that_becomes_too_long() -> None:
    """A topic or node whose name is too long with the namespace is refused."""
    topic, node = "/" + "t" * 240, "/" + "n" * 240 + "/n"
    there = side(endpoint("/a", PUBLISHER, topic), nodes=(node,))
    plan = planned(theirs=there, namespace="/robot_with_a_name")
    assert refused(plan) == {topic: Reason.INVALID_NAME, node: Reason.INVALID_NAME}
    assert plan.ours.nodes == {"/robot_with_a_name/a": "/a"}


def test_a_side_has_a_limit_of_mirrors() -> None:
    """Case 90: beyond the limit whole topics and services are left out on both sides, always the same."""
    there = side(*(endpoint(f"/n{index}", PUBLISHER, f"/t{index}") for index in range(5)))
    here = side(endpoint("/ui", SUBSCRIPTION, "/t4"))
    plan = planned(here, there, max_endpoints=3)
    assert {each.name for each in plan.ours.mirrors} == {"/t0", "/t1", "/t2"}
    assert not plan.theirs.mirrors
    assert not plan.theirs.intake
    assert refused(plan) == {"/t3": Reason.LIMIT}
    nodes = planned(here, there, max_nodes=3)
    assert nodes.ours.nodes.keys() == {"/n0", "/n1", "/n2"}
    assert refused(nodes) == {"/n3": Reason.LIMIT}


def test_a_topic_with_several_subscriptions() -> None:
    """Each node's messages are accepted from one of them: the strongest that all its publishers match."""
    there = side(
        endpoint("/static", PUBLISHER, "/t", qos=LATCHED),
        endpoint("/lossy", PUBLISHER, "/t", qos=BEST_EFFORT),
        endpoint("/both", PUBLISHER, "/t", qos=LATCHED),
        endpoint("/both", PUBLISHER, "/t", qos=BEST_EFFORT),
    )
    plan = planned(side(endpoint("/ui", SUBSCRIPTION, "/t")), there)
    assert len(plan.theirs.intake["/t", STRING]) == 2
    assert plan.theirs.receivers == {("/t", "/static"): 0, ("/t", "/lossy"): 1, ("/t", "/both"): 1}


def test_hidden_names_cross() -> None:
    """Names with a part that begins with an underscore are mirrored like others."""
    assert shown(planned(side(endpoint("/_tool", PUBLISHER, "/_x"))).theirs) == {("/_tool", PUBLISHER, "/_x")}


def test_depth_rules() -> None:
    """A depth rule applies to the mirrors of the topics that it matches."""
    there = side(endpoint("/cam", PUBLISHER, "/camera/a", qos=HIDDEN_HISTORY))
    (mirror,) = planned(theirs=there, depths=(("/camera/**", 3),), namespace="/r").ours.mirrors
    assert mirror.qos is not None
    assert mirror.qos.depth == 3


@pytest.mark.parametrize("seed", range(3))
def test_equal_graphs_give_equal_plans(seed: int) -> None:
    """The order of sets does not matter, and endpoints of nodes that are not there yet are ignored."""
    names = [f"/n{(index * 7 + seed) % 10}" for index in range(10)]
    endpoints = [endpoint(name, PUBLISHER, "/t", BOOL if name < "/n5" else STRING) for name in names]
    late = endpoint("/unknown", PUBLISHER, "/u")
    graph = side(*endpoints)
    late_graph = graph._replace(endpoints=graph.endpoints | {late})
    assert planned(graph) == planned(side(*reversed(endpoints))) == planned(late_graph, known=all_known)
