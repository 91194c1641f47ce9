"""Elements of launch documents: actions and event handlers, with their options as keys.

The names of elements are those of the classes in `description/`. Keys, their kinds and their help follow from
the options of these classes, and the schema follows from the keys, so that the reader, editors and Python
accept the same. Only the differences between documents and Python are written down here.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final, cast

from actors.launch.description.action import EventHandler
from actors.launch.description.actions import (
    COMPONENTS,
    DeclareLaunchArgument,
    GroupAction,
    RegisterEventHandler,
    Shutdown,
    UnsupportedAction,
)
from actors.launch.description.conditions import IfCondition, UnlessCondition
from actors.launch.description.lifecycle import LifecycleNode, LifecycleTransition
from actors.launch.description.options import options_of
from actors.launch.description.process_actions import ExecuteProcess, Node, RosBridge
from actors.launch.description.validation import ELEMENT_CLASSES
from actors.launch.documents import kinds
from actors.launch.documents.parameters import ParameterKind, ParametersKind, RosParametersKind
from actors.tools.suggestions import did_you_mean
from proto.untrusted_text import escape

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from actors.launch.description.action import Action
    from actors.launch.description.options import Option
    from actors.launch.documents.errors import Location


class Elements(kinds.Kind):
    """A list of elements, each a mapping of one name to its value."""

    def read(self, value: object, location: Location) -> tuple[Action, ...]:
        return kinds.read_each(value, location, _read_element)

    def schema(self) -> kinds.Schema:
        return {"$ref": "#/definitions/elements"}


class OnExit(kinds.Kind):
    """A list of elements, or the word shutdown."""

    def read(self, value: object, location: Location) -> Action | tuple[Action, ...]:
        return Shutdown() if value == "shutdown" else _ELEMENTS.read(value, location)

    def schema(self) -> kinds.Schema:
        return {"anyOf": [{"enum": ["shutdown"]}, _ELEMENTS.schema()]}


_ELEMENTS: Final = Elements()
_NAMED: Final = kinds.Named("name", "value")

_KINDS: Final[dict[str, kinds.Kind]] = {
    "str": kinds.PLAIN_NAME,
    "bool": kinds.SWITCH,
    "Text": kinds.TEXT,
    "Text | None": kinds.TEXT,
    "Text | Node": kinds.TEXT,
    "bool | Text": kinds.FLAG,
    "int | Text | None": kinds.BoundedNumber(0, whole=True),
    "float | Text": kinds.NUMBER,
    "float | Text | None": kinds.NUMBER,
    "Sequence[Text]": kinds.Texts(split=True),
    "Sequence[str] | None": kinds.Choices(),
    "Sequence[int | Text]": kinds.Texts(least=1),
    "Node | Text | Sequence[Node | Text]": kinds.Texts(),
    "Mapping[str, Text]": _NAMED,
    "Mapping[str, Text] | Iterable[tuple[str, Text]]": _NAMED,
    "Iterable[tuple[Text, Text]]": kinds.Pairs("from", "to"),
    "Sequence[Parameters]": ParametersKind(),
    "ParameterEntry": ParameterKind(),
    # Only the Python class or the label of a process; the others cannot be written in a document.
    "Factory | str | None": kinds.PLAIN_NAME,
    "Target": kinds.PLAIN_NAME,
    "LifecycleNode | str | None": kinds.PLAIN_NAME,
    "Sequence[Action]": _ELEMENTS,
    "Reaction": _ELEMENTS,
    "Reaction | None": _ELEMENTS,
}
"""The kind of value of each annotation."""
_EXCEPTIONS: Final[dict[tuple[type, str], kinds.Kind]] = {
    (DeclareLaunchArgument, "description"): kinds.PLAIN,
    (ExecuteProcess, "cmd"): kinds.Texts(split=True, least=1),
    (LifecycleTransition, "lifecycle_node_names"): kinds.Texts(least=1),
    **{(each, "on_exit"): OnExit() for each in (Node, LifecycleNode, ExecuteProcess, RosBridge)},
}
"""Options whose values are written differently in documents."""


@dataclass(frozen=True)
class Key:
    """A key of an element.

    Attributes:
        names: The name, and its aliases.
        kind: The kind of its value.
        about: One sentence for users.
        target: The option that it sets. At most one of several keys for an option can be given.
        required: Whether it must be given, under one of its names.
    """

    names: tuple[str, ...]
    kind: kinds.Kind
    about: str
    target: str
    required: bool = False


_CONDITIONS: Final = (
    Key(("if",), kinds.FLAG, "Only if this is true.", "condition"),
    Key(("unless",), kinds.FLAG, "Only if this is false.", "condition"),
)
_CONDITION_NAMES: Final = tuple(name for key in _CONDITIONS for name in key.names)
_PROGRAMS: Final = (("package", "executable"), ("executable",), ("script",), ("node",))
"""What a node runs."""
_ROS_PARAMETERS: Final = Key(("param",), RosParametersKind(), "Parameters as ROS 2 lists them.", "parameters")


@dataclass(frozen=True)
class Element:
    """A kind of element.

    Attributes:
        names: The name, and its aliases.
        cls: The class of the action or event handler.
    """

    names: tuple[str, ...]
    cls: type[Any]

    @property
    def alternatives(self) -> tuple[tuple[str, ...], ...]:
        """Sets of options of which exactly one must be given, completely; empty: no such rule."""
        return _PROGRAMS if issubclass(self.cls, Node) else ()

    @property
    def listed(self) -> str:
        """The key that gets the value if that is a list; empty: it cannot be a list."""
        return "children" if self.cls is GroupAction else ""

    @property
    def about(self) -> str:
        """The first line of the docstring of the class, for users."""
        return (self.cls.__doc__ or "").partition("\n")[0]

    @property
    def keys(self) -> tuple[Key, ...]:
        """All keys."""
        own = [_key(self.cls, each) for each in options_of(self.cls) if each.keys]
        extra = [_ROS_PARAMETERS] if issubclass(self.cls, Node) else []
        return (*own, *extra, *_CONDITIONS)

    def read(self, value: object, location: Location, **more: Any) -> Action:
        """Return the action of an element.

        Args:
            value: Its keys and their values.
            location: Where it is.
            more: Options of the action that no key sets.

        Raises:
            DocumentError: It is malformed.
        """
        if self.listed and isinstance(value, list):
            only = next(key for key in self.keys if self.listed in key.names)
            return self._action({only.target: only.kind.read(cast("object", value), location)}, location)
        # An element without keys is written without a value, such as `- reset_env:`.
        body = kinds.read_mapping({} if value is None else value, location)
        # Aliases are found like names; which one was given is kept for errors.
        by_name = {name: key for key in self.keys for name in key.names}
        values: dict[str, Any] = dict(more)
        given: dict[str, str] = {}
        for name, each in body.items():
            key = by_name.get(name)
            if key is None:
                hint = did_you_mean(name, by_name) or f"; there is {', '.join(sorted(by_name))}"
                raise location.inner(name).error(f"no such key{hint}")
            # Two aliases, or `if` and `unless`: one of them would be ignored.
            if key.target in given:
                raise location.error(f"'{given[key.target]}' and '{name}' cannot both be there")
            given[key.target] = name
            found = key.kind.read(each, location.inner(name))
            values[key.target] = _condition(name, found) if key in _CONDITIONS else found
        self._check(values, location)
        return self._action(values, location)

    def _action(self, values: dict[str, Any], location: Location) -> Action:
        condition = {"condition": values.pop("condition")} if "condition" in values else {}
        # A condition belongs to an action; an event handler becomes one when it is registered.
        if issubclass(self.cls, EventHandler):
            action: Action = RegisterEventHandler(self.cls(**values), **condition)
        else:
            action = self.cls(**values, **condition)
        # Errors that are found when the action is planned can name its line then. It is frozen otherwise.
        object.__setattr__(action, "describe_location", location.describe)
        return action

    def _check(self, values: Mapping[str, Any], location: Location) -> None:
        for key in self.keys:
            if key.required and key.target not in values:
                raise location.error(f"'{key.names[0]}' is missing")
        # Exactly the options of one: with `pkg` alone, or with two programs, it is unclear what to start.
        given = {target for targets in self.alternatives for target in targets if target in values}
        if self.alternatives and given not in map(set, self.alternatives):
            first = {key.target: key.names[0] for key in reversed(self.keys)}
            texts = [" and ".join(first[each] for each in targets) for targets in self.alternatives]
            raise location.error(f"expected one of these: {'; '.join(texts)}")

    def schema(self) -> kinds.Schema:
        """Return its JSON schema."""
        # Aliases are keys of their own: JSON schema has no other way to name them.
        properties = {
            name: {**key.kind.schema(), "description": key.about} for key in self.keys for name in key.names
        }
        mapping: kinds.Schema = {"type": "object", "properties": properties, "additionalProperties": False}
        rules = list(self._rules())
        if rules:
            mapping["allOf"] = rules
        needed = any(key.required for key in self.keys) or self.alternatives
        forms = [mapping]
        if self.listed:
            forms.append(properties[self.listed])
        if not needed:
            forms.append({"type": "null"})
        # Editors show clearer errors for one schema than for a choice of one.
        schema = mapping if len(forms) == 1 else {"anyOf": forms}
        return {"description": self.about, **schema}

    def _rules(self) -> Iterator[kinds.Schema]:
        """Yield the rules beyond single keys: what must be given, and what excludes each other."""
        names: dict[str, list[str]] = {}
        for key in self.keys:
            names.setdefault(key.target, []).extend(key.names)
        for key in self.keys:
            if key.required:
                yield _given(names[key.target])
        # Draft 7 has no keyword for keys that exclude each other, so each pair is a rule.
        for each in names.values():
            for at, name in enumerate(each):
                yield from ({"not": {"required": [name, other]}} for other in each[at + 1 :])
        if self.alternatives:
            every = {target for targets in self.alternatives for target in targets}
            forms: list[kinds.Schema] = []
            for targets in self.alternatives:
                absent = [{"not": _given(names[each])} for each in sorted(every.difference(targets))]
                forms.append({"allOf": [*(_given(names[each]) for each in targets), *absent]})
            yield {"oneOf": forms}


def _key(cls: type, option: Option) -> Key:
    kind = _EXCEPTIONS.get((cls, option.name))  # by class: `cmd` of one is not `cmd` of another
    # Both are checked when the file is read, unless the value has substitutions.
    if kind is None and option.choices:
        kind = kinds.OneOf(option.choices)
    elif kind is None and option.least:
        kind = kinds.BoundedNumber(option.least, whole=option.type.startswith("int"))
    return Key(option.keys, kind or _KINDS[option.type], option.about, option.name, option.required)


def _given(names: list[str]) -> kinds.Schema:
    """Return the schema of a mapping that has one of these keys."""
    return {"required": names} if len(names) == 1 else {"anyOf": [{"required": [name]} for name in names]}


def _condition(word: str, value: Any) -> IfCondition | UnlessCondition:
    # YAML has read `if: true` as a bool; conditions compare strings, as in ROS 2.
    predicate = str(value).lower() if isinstance(value, bool) else value
    return IfCondition(predicate) if word == "if" else UnlessCondition(predicate)


ELEMENTS: Final = tuple(Element(names, cls) for names, cls in ELEMENT_CLASSES.items())
BY_NAME: Final = {name: element for element in ELEMENTS for name in element.names}
UNSUPPORTED: Final = {"node_container": COMPONENTS, "load_composable_node": COMPONENTS}
"""Elements of ROS 2 that callboard does not have, and what to do instead."""


def _read_element(value: object, location: Location) -> Action:
    found = kinds.read_mapping(value, location)  # one key: the name of the element
    # The usual cause is a body that is not indented, so that its keys are beside the element.
    if len(found) != 1:
        listed = (
            f": {', '.join(map(escape, found))}; what is in an element is indented further" if found else ""
        )
        raise location.error(f"expected one element, such as 'node', not {len(found)}{listed}")
    ((name, body),) = found.items()
    if name in UNSUPPORTED:
        return _read_unsupported(name, body, location.inner(name))
    element = BY_NAME.get(name)
    if element is None:
        hint = did_you_mean(name, BY_NAME) or f"; there is {', '.join(sorted(BY_NAME))}"
        raise location.inner(name).error(f"no such element{hint}")
    return element.read(body, location.inner(name))


def _read_unsupported(name: str, body: object, location: Location) -> Action:
    """Return an action that is an error if its conditions hold. Other keys are not checked."""
    conditions = {
        key: each for key, each in kinds.read_mapping(body, location).items() if key in _CONDITION_NAMES
    }
    element = Element((name,), UnsupportedAction)
    return element.read(conditions, location, action_type=name, remedy=UNSUPPORTED[name])
