"""Tests of actors.launch.documents.table: nothing that launches can do is forgotten in it."""

from __future__ import annotations

from dataclasses import fields
from typing import Any

import pytest

from actors.launch.description import actions, event_handlers
from actors.launch.description.actions import Action, RegisterEventHandler
from actors.launch.documents.table import BY_NAME, ELEMENTS
from tests.actors.launch.documents.test_reading import ELEMENT_CASES

PYTHON_ONLY = {"EmitEvent", "OpaqueFunction", "env"}
"""A function cannot be written down; `env` adds to the environment in documents, as in ROS 2's."""


def concrete(base: type, module: Any) -> set[type]:
    """Return the classes of a module that are of a kind, and have no kinds of their own."""
    found = [each for each in vars(module).values() if isinstance(each, type) and issubclass(each, base)]
    return {
        each
        for each in found
        if not any(other.__module__ == each.__module__ for other in each.__subclasses__())
    }


def test_every_action_has_an_element() -> None:
    """But for those that only Python can say."""
    made = {type(action) for _, action in ELEMENT_CASES}
    assert {each.__name__ for each in concrete(Action, actions) - made} <= PYTHON_ONLY


def test_every_event_handler_has_an_element() -> None:
    """Each kind of it."""
    handlers = [each.event_handler for _, each in ELEMENT_CASES if isinstance(each, RegisterEventHandler)]
    assert concrete(event_handlers.EventHandler, event_handlers) == set(map(type, handlers))


@pytest.mark.parametrize("element", ELEMENTS, ids=lambda element: element.names[0])
def test_every_argument_of_an_action_has_a_key(element: Any) -> None:
    """Whatever can be given to an action can be written; and no key is for nothing."""
    case = next(action for text, action in ELEMENT_CASES if text.partition(":")[0] in element.names)
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
