"""Tests of actors.launch.documents.schema: it allows what can be read, and nothing else."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import jsonschema
import pytest
import yaml
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from actors.launch.documents.elements import ELEMENTS, Elements, OnExit
from actors.launch.documents.kinds import (
    FLAG,
    NUMBER,
    PLAIN,
    PLAIN_NAME,
    SWITCH,
    TEXT,
    BoundedNumber,
    Choices,
    OneOf,
    Pairs,
    Texts,
)
from actors.launch.documents.parameters import ParameterKind, ParametersKind, RosParametersKind
from actors.launch.documents.reading import read_document
from actors.launch.documents.schema import schema, schema_text
from actors.launch.errors import LaunchFileError
from tests.actors.launch.documents.test_reading import ELEMENT_CASES, ERROR_CASES

if TYPE_CHECKING:
    from actors.launch.documents.elements import Element, Key
    from actors.launch.documents.kinds import Kind

ROOT: Final = Path(__file__).resolve().parents[4]
DEEP: Final = settings(suppress_health_check=[HealthCheck.too_slow, HealthCheck.data_too_large])
VALIDATOR: Final = jsonschema.Draft7Validator(schema())

texts = st.sampled_from(["a", "true", "$(var x)", "x $(env HOME /)", 1, 2.5, True])
plain = st.sampled_from(["a", "b c", 3, False])
names = st.sampled_from(["a", "b", "from"])
scalars = texts | st.just(-3)


def readable(document: object) -> bool:
    """Tell whether a document can be read."""
    try:
        read_document("/files/a.yaml", yaml.safe_dump(document).encode())
    except LaunchFileError:
        return False
    return True


def test_the_schema_is_one() -> None:
    """It follows its draft, and all that it refers to is there."""
    jsonschema.Draft7Validator.check_schema(schema())
    text = schema_text()
    assert json.loads(text) == schema()
    for each in set(text.split('"#/definitions/')[1:]):
        assert each.partition('"')[0] in schema()["definitions"]


def test_the_file_for_editors_is_what_the_table_says() -> None:
    """After a change: callboard launch --schema > docs/reference/launch.schema.json."""
    file = ROOT / "docs" / "reference" / "launch.schema.json"
    assert file.read_text(encoding="utf-8") == schema_text()


@pytest.mark.parametrize("text", [text for text, _ in ELEMENT_CASES])
def test_what_can_be_read_is_allowed(text: str) -> None:
    """Each element that the reader's tests have."""
    VALIDATOR.validate(yaml.safe_load(f"launch: [{{{text}}}]"))


BEYOND: Final = ("'$(var)' should be", "cannot be split into words", "No substitution")
"""What is wrong within a text; a schema cannot say that."""


@pytest.mark.parametrize(
    "text", [text for text, error in ERROR_CASES if not any(each in error for each in BEYOND)]
)
def test_what_cannot_be_read_is_not_allowed(text: str) -> None:
    """Each mistake that the reader's tests have."""
    assert not VALIDATOR.is_valid(yaml.safe_load(f"launch: [{{{text}}}]"))


def values(key: Key, depth: int) -> st.SearchStrategy[Any]:
    """Return values that fit a key."""
    pair = key.kind if isinstance(key.kind, Pairs) else Pairs("", "")
    pairs = st.dictionaries(names, texts, max_size=2) | st.lists(
        st.fixed_dictionaries({pair.first: names, pair.second: texts}), max_size=2
    )
    parameter = scalars | st.lists(scalars, max_size=3)
    by_name = st.recursive(
        st.dictionaries(names, parameter, max_size=2), lambda below: st.dictionaries(names, below, max_size=2)
    )
    one = st.fixed_dictionaries({"name": names, "value": parameter})
    group = st.fixed_dictionaries({"name": names, "param": st.lists(one, max_size=2)})
    typed = st.fixed_dictionaries({"name": names, "value": texts, "type": st.sampled_from(["str", "int"])})
    file = st.fixed_dictionaries(
        {"from": texts}, optional={"allow_substs": st.booleans() | st.sampled_from(["true", "$(var x)"])}
    )
    ros = one | typed | group | file
    simple: list[tuple[Kind, st.SearchStrategy[Any]]] = [
        (TEXT, texts),
        (PLAIN, plain),
        (PLAIN_NAME, plain),
        (FLAG, st.booleans() | st.sampled_from(["true", "$(var x)", 0, 1])),
        (SWITCH, st.booleans()),
        (NUMBER, st.sampled_from([0, 1.5, "2", "$(var x)"])),
    ]
    for kind, strategy in simple:
        if key.kind is kind:
            return strategy
    kinds: dict[type, st.SearchStrategy[Any]] = {
        OneOf: st.sampled_from(["screen", "log", "$(var x)"]),
        BoundedNumber: st.integers(1, 9) | st.sampled_from(["2", "$(var x)"]),
        Texts: texts | st.lists(texts, min_size=1, max_size=3),
        Choices: st.lists(plain | st.fixed_dictionaries({"value": plain}), max_size=2),
        Pairs: pairs,
        ParameterKind: parameter,
        ParametersKind: texts | by_name | st.lists(texts | by_name, max_size=2),
        RosParametersKind: st.lists(ros, max_size=2),
        Elements: st.deferred(lambda: elements(depth + 1)),
        OnExit: st.just("shutdown") | st.deferred(lambda: elements(depth + 1)),
    }
    return next(kinds[each] for each in type(key.kind).__mro__ if each in kinds)


@st.composite
def bodies(draw: st.DrawFn, element: Element, depth: int) -> dict[str, Any]:
    """Return what stands in an element, with all that it needs and some of what it may have."""
    targets = draw(st.sampled_from(element.alternatives)) if element.alternatives else ()
    others = {target for each in element.alternatives for target in each} - set(targets)
    by_target: dict[str, list[Key]] = {}
    for key in element.keys:
        by_target.setdefault(key.target, []).append(key)
    body: dict[str, Any] = {}
    for target, keys in by_target.items():
        needed = target in targets or any(key.required for key in keys)
        if needed or (target not in others and draw(st.integers(0, 4)) == 0):
            key = draw(st.sampled_from(keys))
            body[draw(st.sampled_from(key.names))] = draw(values(key, depth))
    return body


@st.composite
def elements(draw: st.DrawFn, depth: int = 0) -> list[dict[str, Any]]:
    """Return elements, not too deep."""
    chosen = draw(st.lists(st.sampled_from(ELEMENTS), max_size=2 if depth < 2 else 0))
    return [{draw(st.sampled_from(each.names)): draw(bodies(each, depth))} for each in chosen]


@DEEP
@given(elements())
def test_all_that_the_table_allows_can_be_read(made: list[dict[str, Any]]) -> None:
    """Elements made at random of the table are read, and the schema allows them."""
    document = {"launch": made}
    VALIDATOR.validate(document)
    read_document("/files/a.yaml", yaml.safe_dump(document).encode())


odd = st.sampled_from(
    [
        *(
            None,
            True,
            0,
            -2,
            2.5,
            "",
            "a",
            "shutdown",
            "$(var x)",
            [],
            ["a"],
            [[1]],
            {},
            {"a": 1},
            {"from": "a"},
        ),
        *(
            {"name": "a", "value": "b"},
            {"from": "a", "to": "b"},
            {"$(var x)": 1},
            [{"name": "$(var x)", "value": 1}],
        ),
    ]
)


@DEEP
@given(elements(), st.data())
def test_reader_and_schema_refuse_the_same(made: list[dict[str, Any]], data: st.DataObject) -> None:
    """Elements with something odd put somewhere into them: both take them, or neither does."""
    if not made:
        return
    at = data.draw(st.integers(0, len(made) - 1))
    ((name, body),) = made[at].items()
    key = data.draw(st.sampled_from(["", "nmae", "name", "if", *body]))
    if key:
        body[key] = data.draw(odd)
    else:
        made[at] = {name: data.draw(odd)}
    document = {"launch": made}
    assert VALIDATOR.is_valid(document) == readable(document)
