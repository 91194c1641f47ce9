"""The parameter store: declaring, setting, callbacks, overrides and listing."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import pytest

from actors.parameters.errors import (
    InvalidParameterError,
    InvalidParameterTypeError,
    InvalidParameterValueError,
    ParameterAlreadyDeclaredError,
    ParameterImmutableError,
    ParameterModifiedInCallbackError,
    ParameterNotDeclaredError,
    ParameterUninitializedError,
)
from actors.parameters.store import ParameterStore
from actors.parameters.types import (
    FloatingPointRange,
    Parameter,
    ParameterDescriptor,
    ParameterType,
    SetParametersResult,
)
from proto.errors import CallboardError

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from actors.parameters.changes import ParameterChanges

ALWAYS = ["use_sim_time", "start_type_description_service"]
OK = SetParametersResult(successful=True)


def p(name: str, value: Any) -> Parameter:
    return Parameter(name, value=value)


@pytest.fixture
def store() -> ParameterStore:
    return ParameterStore()


def test_declared_by_default(store: ParameterStore) -> None:
    """Every node has use_sim_time and start_type_description_service."""
    assert store.get("use_sim_time").value is False
    assert store.get("start_type_description_service").value is True
    assert store.describe("start_type_description_service").read_only
    assert ParameterStore(argument_overrides={"use_sim_time": True}).get("use_sim_time").value is True
    with pytest.raises(InvalidParameterTypeError, match="expected BOOL got INTEGER"):
        ParameterStore(argument_overrides={"use_sim_time": 1})


def test_declare_twice(store: ParameterStore) -> None:
    """Declaring twice is an error."""
    assert store.declare("a", 1).value == 1
    with pytest.raises(ParameterAlreadyDeclaredError, match="already declared: a") as caught:
        store.declare("a", 2)
    assert isinstance(caught.value, CallboardError)
    assert caught.value.parameter == "a"


def test_unknown_parameters(store: ParameterStore) -> None:
    """Reading, setting, describing and undeclaring an unknown one is an error; nothing is set then."""
    store.declare("a", 1)
    calls = (
        lambda: store.get("x"),
        lambda: store.set([p("a", 2), p("x", 1)]),
        lambda: store.set_atomically([p("a", 2), p("x", 1)]),
        lambda: store.undeclare("x"),
        lambda: store.describe("x"),
    )
    for call in calls:
        with pytest.raises(ParameterNotDeclaredError, match="undeclared parameter\\(s\\): x"):
            call()
    assert store.get("a").value == 1
    assert (store.has("a"), store.has("x")) == (True, False)


def test_bad_names(store: ParameterStore) -> None:
    """An empty name is InvalidParameter, a name that is no str a TypeError."""
    with pytest.raises(InvalidParameterError, match="Invalid parameter name"):
        store.declare("", 1)
    wrong: Any = 42
    with pytest.raises(TypeError, match="must be a str, not int"):
        store.declare(wrong, 1)


def test_order_of_overrides() -> None:
    """Constructor before arguments before default; ignore_override keeps the default."""
    store = ParameterStore(overrides={"baz": "own"}, argument_overrides={"baz": "file", "fizz": "file"})
    assert store.declare("baz", "default").value == "own"
    assert store.declare("fizz", "default").value == "file"
    assert store.declare("buzz", "default").value == "default"
    store.undeclare("fizz")
    assert store.declare("fizz", "default", ignore_override=True).value == "default"


def test_override_of_another_type() -> None:
    """An override has to have the declared type; an int for a double says what to write."""
    store = ParameterStore(argument_overrides={"speed": 1, "name": 2})
    with pytest.raises(InvalidParameterTypeError, match=r"expected DOUBLE got INTEGER \(write 1\.0\): speed"):
        store.declare("speed", 0.5)
    assert not store.has("speed")
    with pytest.raises(TypeError, match="expected STRING got INTEGER"):
        store.declare("name", ParameterType.STRING)


def test_declare_all_overrides() -> None:
    """Overrides can be declared at once, with their own types."""
    store = ParameterStore(argument_overrides={"a": 1, "use_sim_time": True})
    store.declare_overrides()
    assert store.get("a").value == 1
    assert "Wrong parameter type" in store.set([p("a", "x")])[0].reason


def test_static_typing(store: ParameterStore) -> None:
    """Another type and None are refused for a static parameter."""
    store.declare("a", 1)
    (result,) = store.set([p("a", "asd")])
    assert not result.successful
    assert result.reason.startswith("Wrong parameter type")
    (result,) = store.set([p("a", None)])
    assert result == SetParametersResult(False, "Static parameter cannot be undeclared")
    assert store.get("a").value == 1


def test_dynamic_typing(store: ParameterStore) -> None:
    """A dynamic parameter changes its type, and None undeclares it."""
    store.declare("a", 1, ParameterDescriptor(dynamic_typing=True))
    store.declare("b")
    assert store.get("b").type_ is ParameterType.NOT_SET
    assert store.set([p("a", "text"), p("b", 1.5)]) == [OK, OK]
    assert store.describe("a").type is ParameterType.STRING
    assert store.describe("b").type is ParameterType.DOUBLE
    assert store.set([p("a", None)]) == [OK]
    assert not store.has("a")


def test_type_without_value(store: ParameterStore) -> None:
    """Declared with a type only, a parameter cannot be read before it is set."""
    store.declare("a", ParameterType.INTEGER_ARRAY)
    with pytest.raises(ParameterUninitializedError, match="not initialized: a"):
        store.get("a")
    assert store.get_or("a", p("a", [7])).value == [7]
    assert store.set([p("a", ["x"])])[0].reason.startswith("Wrong parameter type")
    assert store.set([p("a", [])]) == [OK]
    assert store.get("a").type_ is ParameterType.INTEGER_ARRAY
    with pytest.raises(ValueError, match="type NOT_SET"):
        store.declare("b", ParameterType.NOT_SET)


def test_get_or(store: ParameterStore) -> None:
    """get_or returns the value if there is one, then the alternative, then one without a value."""
    store.declare("a", 1)
    assert store.get_or("a", p("a", 2)).value == 1
    assert store.get_or("x", p("x", 2)).value == 2
    assert store.get_or("x").type_ is ParameterType.NOT_SET


def test_set_is_per_item(store: ParameterStore) -> None:
    """Set keeps what succeeds, set_atomically all or nothing."""
    store.declare_many("", [("a", 1), ("b", 1), ("c", 1)])
    results = store.set([p("a", 2), p("b", "x"), p("c", 2)])
    assert [result.successful for result in results] == [True, False, True]
    assert [store.get(name).value for name in "abc"] == [2, 1, 2]
    assert not store.set_atomically([p("a", 3), p("b", "x"), p("c", 3)]).successful
    assert [store.get(name).value for name in "abc"] == [2, 1, 2]
    assert store.set_atomically([p("a", 3), p("b", 3)]) == OK


def test_read_only(store: ParameterStore) -> None:
    """A read-only parameter is neither set nor undeclared."""
    store.declare("a", 1, ParameterDescriptor(read_only=True, description="fixed"))
    assert store.set([p("a", 2)]) == [SetParametersResult(False, "Trying to set a read-only parameter: a.")]
    with pytest.raises(ParameterImmutableError, match="read-only parameter: a"):
        store.undeclare("a")
    assert store.describe("a").description == "fixed"
    store.declare("b", 1)
    store.undeclare("b")
    assert not store.has("b")


def test_an_on_set_callback_without_an_answer_refuses(store: ParameterStore) -> None:
    """What is no result refuses the values, with a warning that names the callback."""
    store.declare("a", 1)
    forgetful: Any = lambda parameters: None  # noqa: E731 - its type is the fault
    store.callbacks.on_set.append(forgetful)
    with pytest.warns(UserWarning, match="lambda.*returned None, not a SetParametersResult"):
        [result] = store.set([Parameter("a", value=2)])
    assert not result.successful
    assert store.get("a").value == 1


def test_on_set_callback(store: ParameterStore) -> None:
    """A refusal leaves the value, and raises at declaration; removing the callback ends it."""
    seen: list[list[Any]] = []

    def refuse_negative(parameters: list[Parameter]) -> SetParametersResult:
        seen.append([each.value for each in parameters])
        return SetParametersResult(all(each.value != -1 for each in parameters), "negative")

    store.declare("a", 1)
    store.callbacks.on_set.insert(0, refuse_negative)
    assert store.set([p("a", -1)]) == [SetParametersResult(False, "negative")]
    assert store.set([p("a", 2)]) == [OK]
    with pytest.raises(InvalidParameterValueError, match="Reason: negative: b"):
        store.declare("b", -1)
    assert not store.has("b")
    assert seen == [[-1], [2], [-1]]
    store.callbacks.on_set.remove(refuse_negative)
    assert store.set([p("a", -1)]) == [OK]
    with pytest.raises(ValueError, match="not in list"):
        store.callbacks.on_set.remove(refuse_negative)


def test_an_on_set_callback_cannot_change_what_is_set(store: ParameterStore) -> None:
    """What it does with its list changes neither what is set nor what the other callbacks get."""
    store.declare("a", 1)
    store.declare("fixed", 1, ParameterDescriptor(read_only=True))
    seen: list[list[Parameter]] = []

    def meddle(parameters: list[Parameter]) -> SetParametersResult:
        parameters[:] = [p("fixed", 2)]
        return SetParametersResult(successful=True)

    store.callbacks.on_set.insert(0, meddle)
    store.callbacks.post_set[:] = [list.clear, seen.append]
    assert store.set_atomically([p("a", 2)]).successful
    assert (store.get("a").value, store.get("fixed").value) == (2, 1)
    assert seen == [[p("a", 2)]]


def test_refusal_without_a_reason(store: ParameterStore) -> None:
    """A refusal is one although it gives no reason."""
    store.callbacks.on_set.insert(0, lambda _: SetParametersResult(successful=False))
    assert not store.set([p("use_sim_time", True)])[0].successful
    with pytest.raises(InvalidParameterValueError):
        store.declare("a", 1)


def test_a_raising_callback_changes_nothing(store: ParameterStore) -> None:
    """An exception in a callback reaches the caller before any value is set."""
    store.declare("a", 1)
    store.callbacks.on_set.insert(0, lambda _: OK)

    def boom(_: list[Parameter]) -> SetParametersResult:
        raise RuntimeError("boom")

    store.callbacks.on_set.insert(0, boom)
    with pytest.raises(RuntimeError, match="boom"):
        store.set([p("a", 2)])
    assert store.get("a").value == 1


def test_pre_set_callback(store: ParameterStore) -> None:
    """It may add and change items; an empty list is a failure; it does not run on declaring."""
    store.callbacks.pre_set.insert(0, lambda given: [*given, p("b", 9)])
    store.declare_many("", [("a", 1), ("b", 1)])
    assert store.get("b").value == 1
    assert store.set([p("a", 2)]) == [OK]
    assert (store.get("a").value, store.get("b").value) == (2, 9)
    store.callbacks.pre_set.insert(0, lambda _: [])
    assert not store.set([p("a", 3)])[0].successful
    assert store.get("a").value == 2


def test_pre_set_callback_may_not_add_undeclared(store: ParameterStore) -> None:
    """What it adds has to be declared too."""
    store.callbacks.pre_set.insert(0, lambda given: [*given, p("x", 9)])
    with pytest.raises(ParameterNotDeclaredError):
        store.set([p("use_sim_time", True)])
    assert store.get("use_sim_time").value is False


def test_post_set_callback(store: ParameterStore) -> None:
    """It runs after success only, when the value can be read."""
    seen: list[object] = []
    store.declare("a", 1)
    store.callbacks.post_set.insert(0, lambda _: seen.append(store.get("a").value))
    store.set([p("a", 2), p("a", "x")])
    assert seen == [2]


def test_range(store: ParameterStore) -> None:
    """Values out of range are refused when set and when declared."""
    bounds = FloatingPointRange(from_value=0.0, to_value=10.0, step=0.5)
    descriptor = ParameterDescriptor(floating_point_range=[bounds])
    store.declare("a", 1.0, descriptor)
    assert [result.successful for result in store.set([p("a", 4.5), p("a", 12.0), p("a", 4.25)])] == [
        True,
        False,
        False,
    ]
    assert store.get("a").value == 4.5
    with pytest.raises(InvalidParameterValueError, match="b out of range"):
        store.declare("b", 11.0, descriptor)
    assert store.declare("c", 11, descriptor).value == 11


def test_by_prefix(store: ParameterStore) -> None:
    """Names lose the prefix; no match is an empty dict; an empty prefix matches all."""
    store.declare_many("foo", [("a", 1), ("b.c", 2)])
    store.declare("foobar", 3)
    assert {name: each.value for name, each in store.get_by_prefix("foo").items()} == {"a": 1, "b.c": 2}
    assert store.get_by_prefix("nothing") == {}
    assert set(store.get_by_prefix("")) == {*ALWAYS, "foo.a", "foo.b.c", "foobar"}


def test_list(store: ParameterStore) -> None:
    """Depth 0 lists all, depth n that many levels; each prefix is reported once."""
    store.declare_many("", [("a", 1), ("foo.a", 1), ("foo.b", 1), ("foo.bar.c", 1), ("foofoo", 1)])
    listed = store.list_names()
    assert listed.names == [*ALWAYS, "a", "foo.a", "foo.b", "foo.bar.c", "foofoo"]
    assert listed.prefixes == ["foo", "foo.bar"]
    assert store.list_names(depth=1).names == [*ALWAYS, "a", "foofoo"]
    assert store.list_names(["foo"]).names == ["foo.a", "foo.b", "foo.bar.c"]
    assert store.list_names(["foo"], depth=1).names == ["foo.a", "foo.b"]
    assert store.list_names(["foo"], depth=1).prefixes == ["foo"]
    assert store.list_names(["foo.bar", "a"]).names == ["a", "foo.bar.c"]
    assert store.list_names(["x"]).names == []
    with pytest.raises(TypeError, match="not a str"):
        store.list_names("foo")
    with pytest.raises(ValueError, match="not be negative"):
        store.list_names(depth=-1)


def test_declare_many(store: ParameterStore) -> None:
    """Several at once, with a prefix; a taken or bad name is found before any is declared."""
    declared = store.declare_many(
        "ns", [("a", 1), ("b", ParameterType.STRING), ("c",), ("d", 1, ParameterDescriptor())]
    )
    assert [each.name for each in declared] == ["ns.a", "ns.b", "ns.c", "ns.d"]
    wrong: list[tuple[list[Any], type[Exception]]] = [
        ([("x", 1), ("a", 1)], ParameterAlreadyDeclaredError),
        ([("x", 1), ("x", 2)], ParameterAlreadyDeclaredError),
        ([("x", 1), ("", 2)], InvalidParameterError),
        ([("x", 1), (3, 2)], TypeError),
    ]
    for parameters, error in wrong:
        with pytest.raises(error):
            store.declare_many("ns", parameters)
    assert not store.has("ns.x")


def test_undeclared_allowed() -> None:
    """Where undeclared parameters are allowed, reading gives none and setting declares one."""
    store = ParameterStore(allow_undeclared=True)
    assert store.get("a").type_ is ParameterType.NOT_SET
    assert store.set([p("a", 1), p("a", "x")]) == [OK, OK]
    assert store.get("a").value == "x"
    assert store.set([p("never", None)]) == [OK]


def test_set_descriptor(store: ParameterStore) -> None:
    """A new descriptor is checked against the value that it will hold; the type stays."""
    store.declare("a", 1.0)
    narrow = ParameterDescriptor(floating_point_range=[FloatingPointRange(from_value=0, to_value=2)])
    assert store.set_descriptor("a", narrow) == p("a", 1.0)
    assert store.describe("a").type is ParameterType.DOUBLE
    assert not store.set([p("a", 3.0)])[0].successful
    high = ParameterDescriptor(floating_point_range=[FloatingPointRange(from_value=5, to_value=9)])
    with pytest.raises(InvalidParameterValueError, match="a out of range"):
        store.set_descriptor("a", high)
    assert store.describe("a").floating_point_range == narrow.floating_point_range
    assert store.set_descriptor("a", high, 6.0) == p("a", 6.0) == store.get("a")
    with pytest.raises(InvalidParameterTypeError):
        store.set_descriptor("a", high, "text")
    store.set_descriptor("a", ParameterDescriptor(read_only=True))
    with pytest.raises(ParameterImmutableError):
        store.set_descriptor("a", narrow)
    with pytest.raises(ParameterNotDeclaredError):
        store.set_descriptor("x", narrow)


def test_a_set_callback_may_not_change_parameters(store: ParameterStore) -> None:
    """While callbacks decide, declaring, setting and removing is an error; afterwards it works again."""
    store.declare("a", 1)
    store.declare("b", 1)
    attempts: list[Callable[[], object]] = [
        lambda: store.declare("c", 1),
        lambda: store.undeclare("b"),
        lambda: store.set([p("b", 2)]),
        lambda: store.set_atomically([p("b", 2)]),
        lambda: store.set_descriptor("b", ParameterDescriptor()),
    ]

    def meddle(_: object) -> SetParametersResult:
        for attempt in attempts:
            with pytest.raises(ParameterModifiedInCallbackError):
                attempt()
        return OK

    store.callbacks.on_set.append(meddle)
    assert store.set([p("a", 2)]) == [OK]
    store.callbacks.pre_set.append(lambda given: given if meddle(given).successful else [])
    assert store.set([p("a", 3)]) == [OK]
    assert (store.get("a").value, store.get("b").value) == (3, 1)


def test_a_callback_may_remove_itself(store: ParameterStore) -> None:
    """Callbacks that are added or removed in one count from the next set on; nobody is left out."""
    store.declare("a", 1)
    seen: list[str] = []

    def once(_: object) -> None:
        seen.append("once")
        store.callbacks.post_set.remove(once)

    store.callbacks.post_set += [once, lambda _: seen.append("always")]
    store.set([p("a", 2), p("a", 3)])
    assert seen == ["once", "always", "always"]


def test_changes_are_told(store: ParameterStore) -> None:
    """What was declared, set and removed, once for each operation, before the post-set callbacks."""
    told: list[tuple[list[str], list[str], list[str]]] = []

    def names(parameters: list[Parameter]) -> list[str]:
        return [each.name for each in parameters]

    def note(changes: ParameterChanges) -> None:
        told.append((names(changes.new), names(changes.changed), names(changes.deleted)))

    store.listeners.append(note)
    store.declare("typed", ParameterType.INTEGER)
    assert told == []
    store.callbacks.post_set.append(lambda _: told.append(([], [], [])))
    store.set([p("typed", 1)])
    assert told == [(["typed"], [], []), ([], [], [])]
    del told[:]
    store.set_atomically([p("typed", 1), p("typed", 2)])
    store.set([p("typed", "text")])
    store.undeclare("typed")
    assert told == [([], ["typed"], []), ([], [], []), ([], [], ["typed"])]


def test_strangers_cannot_declare_any_number() -> None:
    """With undeclared parameters allowed, other nodes can add them, up to a limit."""
    store = ParameterStore(allow_undeclared=True, max_parameters=4)
    assert [each.successful for each in store.set([p("a", 1), p("b", 1), p("c", 1), p("a", 2)])] == [
        True, True, False, True,
    ]  # fmt: skip


@pytest.mark.parametrize("name", ["", "n" * 4097])
def test_strangers_cannot_declare_any_name(name: str) -> None:
    """A name that is set without being declared is neither empty nor endless."""
    result = ParameterStore(allow_undeclared=True).set_atomically([p(name, 1)])
    assert (result.successful, result.reason) == (False, "Invalid parameter name")


def test_many_prefixes_are_read_once(store: ParameterStore) -> None:
    """A request with many prefixes is not compared with every name, so that it cannot hold a node."""

    class Counted(list[str]):
        read = 0

        def __iter__(self) -> Iterator[str]:
            self.read += 1
            return super().__iter__()

    store.declare_many("a.b", [(f"n{number}", 1) for number in range(10)])
    prefixes = Counted(["x", "a", "y"])
    assert len(store.list_names(prefixes).names) == 10
    assert prefixes.read == 1
    assert store.list_names(["a"], 1).names == []
    assert len(store.list_names(["a"], 2).names) == len(store.list_names(["a.b"], 1).names) == 10
