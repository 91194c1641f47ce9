"""Tests of actors.launch.documents.elements: nothing that launches can do is forgotten in it."""

from __future__ import annotations

from dataclasses import fields
from typing import Any

import pytest

from actors.launch.description import action, actions, event_handlers, process_actions
from actors.launch.description.action import Action, EventHandler
from actors.launch.description.actions import RegisterEventHandler
from actors.launch.documents.elements import BY_NAME, ELEMENTS
from tests.actors.launch.documents.test_reading import ELEMENT_CASES

PYTHON_ONLY = {
    "EmitEvent",
    "OpaqueFunction",
    "PopEnvironment",
    "PopLaunchConfigurations",
    "PushEnvironment",
    "PushLaunchConfigurations",
    "UnsetLaunchConfiguration",
    "UnsupportedAction",
    "env",
}
"""A function cannot be written down, documents save and restore by groups, `env` adds as in ROS 2, and
unsupported actions have names of their own."""


def concrete(base: type) -> set[type]:
    """Return the classes in the modules of a description that derive from one and are no bases there."""
    modules = (action, actions, event_handlers, process_actions)
    found = {
        each
        for module in modules
        for each in vars(module).values()
        if isinstance(each, type) and issubclass(each, base)
    }
    return {each for each in found if found.isdisjoint(each.__subclasses__())}


def test_every_action_has_an_element() -> None:
    """But for those that only Python can say."""
    made = {type(each) for _, each in ELEMENT_CASES}
    assert {each.__name__ for each in concrete(Action) - made} <= PYTHON_ONLY


def test_every_event_handler_has_an_element() -> None:
    """Each kind of it."""
    handlers = [each.event_handler for _, each in ELEMENT_CASES if isinstance(each, RegisterEventHandler)]
    assert concrete(EventHandler) == set(map(type, handlers))


@pytest.mark.parametrize("element", ELEMENTS, ids=lambda element: element.names[0])
def test_every_argument_of_an_action_has_a_key(element: Any) -> None:
    """Whatever can be given to an action can be written; and no key is for nothing."""
    case = next(each for text, each in ELEMENT_CASES if text.partition(":")[0] in element.names)
    model: Any = case.event_handler if isinstance(case, RegisterEventHandler) else case
    arguments = {each.name for each in fields(model)} | {"condition"}
    targets = {key.target for key in element.keys}
    assert targets <= arguments
    assert arguments - targets <= PYTHON_ONLY


def test_names_are_one_elements_alone() -> None:
    """Neither elements nor keys share a name."""
    assert len(BY_NAME) == sum(len(each.names) for each in ELEMENTS)
    for each in ELEMENTS:
        names = [name for key in each.keys for name in key.names]
        assert len(names) == len(set(names))
