"""Checks the types of the arguments that launch files give to the entities of a description.

Launch files are seldom type-checked, and a string in place of a list would be read letter by letter. So each
entity checks its arguments when it is created, while the line of the launch file is known. The annotations of
its fields say what to check: `ARGUMENT_TYPES` has a check and an error message for each.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, fields
from pathlib import PurePath
from typing import Any, ClassVar, Final, cast

from actors.launch.description.options import REQUIRED, default_of, document_options
from actors.launch.errors import LaunchError
from proto.untrusted_text import escape

MAX_DEPTH: Final = 50
"""Limit of nested lists, so that a list that contains itself is refused."""
MAX_SHOWN: Final = 100
"""Characters of a wrong value in an error."""

ELEMENT_CLASSES: Final[dict[tuple[str, ...], type]] = {}
"""The actions and event handlers of launch documents, by their names, the preferred one first."""


class Entity:
    """An entity of a description, which is a dataclass: an action, event handler, substitution or condition.

    Attributes:
        kind: Its kind, such as "action", for checks here, which cannot import the classes: they import this.
        describe_location: Returns its location in a launch document; None if it was created in Python.
    """

    kind: ClassVar[str]
    describe_location: Callable[[], str] | None = None

    def __init_subclass__(cls, *, element: str = "") -> None:
        """Add the options of a class to its docstring, and the class to the elements of launch documents.

        Args:
            element: Its names there, the preferred one first, separated by spaces; empty: only Python has it.
        """
        document_options(cls)
        if element:
            ELEMENT_CLASSES[tuple(element.split())] = cls

    def __post_init__(self) -> None:
        """Check the arguments. None for one that has a default is the default, as in ROS 2's launch files.

        Raises:
            LaunchError: An argument has the wrong type.
        """
        for each in fields(cast("Any", self)):
            value: object = getattr(self, each.name)
            if isinstance(value, Iterator):
                # Descriptions are read more than once; an iterator would be empty the second time.
                value = tuple(cast("Iterator[object]", value))
                object.__setattr__(self, each.name, value)
            expected = ARGUMENT_TYPES.get(str(each.type))
            if value is None and expected is not None and not expected.fits(value):
                value = None if (default := default_of(each)) is REQUIRED else default
                object.__setattr__(self, each.name, value)
            if expected is not None and not expected.fits(value):
                raise LaunchError(
                    f"{type(self).__name__}: {each.name} must be {expected.wanted}, not {excerpt(value)}"
                )


@dataclass(frozen=True)
class ArgumentType:
    """A type of argument.

    Attributes:
        wanted: Describes it in an error.
        fits: Tells whether a value has it.
    """

    wanted: str
    fits: Callable[[Any], bool]


def excerpt(value: object) -> str:
    """Return the shortened `repr` of a value."""
    text = escape(repr(value))
    return text if len(text) <= MAX_SHOWN else f"{text[:MAX_SHOWN]}…"


def is_entity(value: object, kind: str) -> bool:
    """Return whether a value is an entity of this kind."""
    return isinstance(value, Entity) and value.kind == kind


def is_text(value: object, depth: int = 0) -> bool:
    """Return whether a value is a string, a path, a substitution, or a list of these."""
    if isinstance(value, str | PurePath) or is_entity(value, "substitution"):
        return True
    listed = isinstance(value, Sequence) and depth < MAX_DEPTH
    return listed and all(is_text(each, depth + 1) for each in cast("Sequence[object]", value))


def _is_list(value: object, fits: Callable[[object], bool]) -> bool:
    """Return whether a value is a collection of fitting values, and not a string or mapping."""
    listed = isinstance(value, Collection) and not isinstance(value, str | bytes | Mapping)
    return listed and all(map(fits, cast("Collection[object]", value)))


def _is_mapping(value: object) -> bool:
    return isinstance(value, Mapping) and all(
        isinstance(name, str) and is_text(each)
        for name, each in cast("Mapping[object, object]", value).items()
    )


def _is_pair(value: object) -> bool:
    return (
        isinstance(value, tuple | list)
        and len(cast("Sequence[object]", value)) == 2
        and is_text(cast("object", value))
    )


def _is_named_pair(value: object) -> bool:
    return _is_pair(value) and isinstance(cast("Sequence[object]", value)[0], str)


def _is_action(value: object) -> bool:
    return is_entity(value, "action")


def _is_process(value: object) -> bool:
    return _is_action(value) and hasattr(value, "respawn")


def _is_lifecycle_node(value: object) -> bool:
    return _is_action(value) and hasattr(value, "autostart")


def _is_target(value: object) -> bool:
    return value is None or isinstance(value, str) or _is_process(value) or callable(value)


def _is_reaction(value: object) -> bool:
    return _is_action(value) or _is_list(value, _is_action) or callable(value)


def _is_truth(value: object) -> bool:
    return isinstance(value, bool) or is_text(value)


def _is_number(value: object) -> bool:
    return (isinstance(value, int | float) and not isinstance(value, bool)) or is_text(value)


def _is_parameters(value: object) -> bool:
    return isinstance(value, Mapping) or is_text(value)


def _is_dependency(value: object) -> bool:
    return _is_process(value) or is_text(value)


def _is_plain(value: object) -> bool:
    return isinstance(value, str)


_TEXT: Final = ArgumentType("a string or a substitution", is_text)
_TEXTS: Final = ArgumentType(
    "a list of strings, such as ['echo', 'hello']", lambda value: _is_list(value, is_text)
)
_MAPPING: Final = ArgumentType("a mapping of names to strings, such as {'NAME': 'value'}", _is_mapping)
_ACTION: Final = "an action such as LogInfo(…), a list of actions, or a function"


def _optional(base: ArgumentType) -> ArgumentType:
    return ArgumentType(f"{base.wanted}, or None", lambda value: value is None or base.fits(value))


_TRUTH: Final = ArgumentType("True or False, or a string such as 'true'", _is_truth)
_NUMBER: Final = ArgumentType("a number, or a string such as '1.5'", _is_number)
_REACTION: Final = ArgumentType(_ACTION, _is_reaction)

ARGUMENT_TYPES: Final[Mapping[str, ArgumentType]] = {
    "str": ArgumentType("a string", _is_plain),
    "bool": ArgumentType("True or False", lambda value: isinstance(value, bool)),
    "Text": _TEXT,
    "Text | None": _optional(_TEXT),
    "bool | Text": _TRUTH,
    "Truth": _TRUTH,
    "Value": ArgumentType(
        "a string, a number, or True or False", lambda value: _is_truth(value) or _is_number(value)
    ),
    "int | Text": _NUMBER,
    "int | Text | None": _optional(_NUMBER),
    "float | Text": _NUMBER,
    "float | Text | None": _optional(_NUMBER),
    "Sequence[Text]": _TEXTS,
    "Sequence[str] | None": ArgumentType(
        "a list of strings, or None", lambda value: value is None or _is_list(value, _is_plain)
    ),
    "Mapping[str, Text]": _MAPPING,
    "Mapping[str, Text] | None": _optional(_MAPPING),
    "Mapping[str, Text] | Iterable[tuple[str, Text]]": ArgumentType(
        "a mapping of names to strings, or pairs of them",
        lambda value: _is_mapping(value) or _is_list(value, _is_named_pair),
    ),
    "Iterable[tuple[Text, Text]]": ArgumentType(
        "a list of pairs, such as [('chatter', 'news')]", lambda value: _is_list(value, _is_pair)
    ),
    "Sequence[Parameters]": ArgumentType(
        "a list of mappings and of paths of YAML files, such as [{'speed': 1.5}]",
        lambda value: _is_list(value, _is_parameters),
    ),
    "Mapping[str, Any]": ArgumentType("a mapping", lambda value: isinstance(value, Mapping)),
    "Iterable[Any]": ArgumentType(
        "a list", lambda value: isinstance(value, Iterable) and not isinstance(value, str)
    ),
    "Callable[..., Any]": ArgumentType("a function", callable),
    "Matcher": ArgumentType(
        "matches_action(…), matches_node_name(…) or a function",
        lambda value: is_entity(value, "matcher") or callable(value),
    ),
    "Condition | None": ArgumentType(
        "a condition, such as IfCondition('true'), or None",
        lambda value: value is None or is_entity(value, "condition"),
    ),
    "Sequence[Action]": ArgumentType(
        "a list of actions, such as [LogInfo(…)]", lambda value: _is_list(value, _is_action)
    ),
    "Shutdown | ChangeState": ArgumentType(
        "Shutdown() or ChangeState(…)",
        lambda value: is_entity(value, "event") or (_is_action(value) and hasattr(value, "reason")),
    ),
    "LifecycleNode | str | None": ArgumentType(
        "a LifecycleNode, the name of one, or None",
        lambda value: value is None or isinstance(value, str) or _is_lifecycle_node(value),
    ),
    "Sequence[int | Text]": ArgumentType(
        "a list of numbers and strings", lambda value: _is_list(value, _is_number)
    ),
    "Reaction": _REACTION,
    "Reaction | None": _optional(_REACTION),
    "EventHandler": ArgumentType(
        "an event handler, such as OnProcessExit(…)", lambda value: is_entity(value, "event handler")
    ),
    "Node | Text | Sequence[Node | Text]": ArgumentType(
        "a Node, a string such as 'topic chatter', or a list of these",
        lambda value: _is_dependency(value) or _is_list(value, _is_dependency),
    ),
    "ProcessAction": ArgumentType("a Node or an ExecuteProcess", _is_process),
    "Target": ArgumentType("a Node, an ExecuteProcess, the name of one, a function, or None", _is_target),
    "Text | Node": ArgumentType("a string or a Node", _is_dependency),
}
"""The check of each annotation. Values of other annotations are checked when they are used."""
