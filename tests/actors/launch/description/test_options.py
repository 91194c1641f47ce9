"""The table of options: constructors, docstrings, documents, schema and specifications agree with it."""

from __future__ import annotations

import inspect
from dataclasses import fields
from typing import Any

import pytest

import actors.launch
from actors.launch.description.action import Action, EventHandler
from actors.launch.description.options import REQUIRED, options_of
from actors.launch.description.process_actions import ProcessAction
from actors.launch.documents.elements import ELEMENTS
from actors.launch.documents.schema import schema
from actors.launch.planning.process_spec import ProcessSpec

PLANNED = {"env", "additional_env", "prefix", "depends_on", "on_exit", "condition"}
"""Options from which the planner makes something else than one field of a specification."""
CLASSES = [
    each
    for each in (getattr(actors.launch, name) for name in dir(actors.launch))
    if isinstance(each, type) and issubclass(each, Action | EventHandler)
]


@pytest.mark.parametrize("cls", CLASSES)
def test_an_option_is_a_parameter_with_its_default_and_sentence(cls: type) -> None:
    """Of each public class; the docstring has the options of its bases, too."""
    parameters = inspect.signature(cls).parameters
    words = " ".join((inspect.getdoc(cls) or "").split())
    for each in options_of(cls):
        parameter = parameters[each.name]
        assert (parameter.default is inspect.Parameter.empty) == each.required
        assert f"{each.name}: {' '.join(each.about.split())}" in words


@pytest.mark.parametrize("element", ELEMENTS, ids=lambda element: element.names[0])
def test_documents_have_the_options_of_their_class(element: Any) -> None:
    """Each parameter is an option, and the schema has its names in documents, and no others."""
    rows = options_of(element.cls)
    assert {each.name for each in rows} == set(inspect.signature(element.cls).parameters)
    made: Any = schema()["definitions"][f"element_{element.names[0]}"]
    properties = made.get("properties") or made["anyOf"][0]["properties"]
    ros = {"param"} if issubclass(element.cls, actors.launch.Node) else set[str]()
    assert properties.keys() == {name for each in rows for name in each.keys} | {"if", "unless"} | ros
    for each in rows:
        assert all(properties[name]["description"] == each.about for name in each.keys)


def test_a_specification_has_the_options_of_a_process() -> None:
    """Under their names; those of durations end in _sec."""
    rows = [each for each in options_of(ProcessAction) if each.name not in PLANNED]
    names = {f"{each.name}_sec" if each.unit else each.name for each in rows}
    assert names <= {each.name for each in fields(ProcessSpec)}


def test_a_row_has_what_the_field_says() -> None:
    """Name, annotation and default are the field's; sentence, unit, range and keys are the table's."""
    (row,) = [each for each in options_of(actors.launch.Node) if each.name == "respawn_backoff"]
    assert (row.type, row.default, row.least, row.keys) == ("float | Text", 2.0, 1, ("respawn_backoff",))
    (row,) = [each for each in options_of(actors.launch.ExecuteProcess) if each.name == "cmd"]
    assert row.default is REQUIRED
