"""Tests of declarations on methods."""

from __future__ import annotations

from typing import Any, Final

import pytest

import actors
from actors.interfaces.example_interfaces.srv import AddTwoInts
from actors.interfaces.std_msgs.msg import String
from actors.node.decorators import declared
from tests.actors.meeting import BARE
from tests.seams.nodes import endpoints_of


class Base(actors.Node):
    def __init__(self) -> None:
        super().__init__("decorated", use_global_arguments=False, **BARE)

    @actors.subscription(String, "heard", 5)
    @actors.subscription(String, "heard_too", 7)
    def on_message(self, msg: String) -> None: ...

    @actors.service(AddTwoInts, "add")
    def add(self, request: AddTwoInts.Request) -> AddTwoInts.Response:
        return AddTwoInts.Response(sum=request.a + request.b)

    @actors.timer(0.5)
    def tick(self) -> None: ...


class Child(Base):
    @actors.timer(0.1)
    def tick(self) -> None: ...

    def add(self, request: AddTwoInts.Request) -> AddTwoInts.Response:
        return AddTwoInts.Response()


def test_declarations_stand_in_order_of_definition() -> None:
    """Two decorators on one method are two declarations."""
    assert [name for name, _ in declared(Base, actors.Node)] == ["on_message", "on_message", "add", "tick"]


def test_an_overridden_method_counts_as_the_subclass_has_it() -> None:
    """An override without a decorator takes the declaration back; one with its own replaces it."""
    assert [name for name, _ in declared(Child, actors.Node)] == ["on_message", "on_message", "tick"]


def test_a_node_has_what_its_class_declares() -> None:
    """The endpoints exist as soon as the node does."""
    node = Base()
    kinds = sorted(endpoint.kind for endpoint in endpoints_of(node))
    assert kinds == ["service", "subscription", "subscription"]
    assert [timer.period_sec for timer in node.diagnostics().timers] == [0.5]


FORMER: Final[dict[str, Any]] = {"qos": 3}  # type checkers know the new name alone


def test_the_former_name_of_qos_profile_still_works() -> None:
    """With a warning that names the caller's file."""
    node = actors.Node("one", use_global_arguments=False)
    with pytest.warns(DeprecationWarning, match="`qos=` is called `qos_profile=`") as caught:
        subscription = node.create_subscription(String, "chatter", **FORMER)
    assert subscription.qos_profile.depth == 3
    with pytest.warns(DeprecationWarning, match="qos_profile") as also_caught:
        actors.subscription(String, "chatter", qos=3)
    assert caught[0].filename == also_caught[0].filename == __file__
    node.destroy_node()
