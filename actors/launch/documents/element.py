"""Elements of launch documents: their keys, as data, and the actions that they become."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final, cast

from actors.launch.description.conditions import IfCondition, UnlessCondition
from actors.launch.documents.kinds import FLAG, Kind, Schema, read_mapping
from actors.tools.suggestions import did_you_mean

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping

    from actors.launch.description.action import Action
    from actors.launch.description.conditions import Condition
    from actors.launch.documents.errors import Spot


@dataclass(frozen=True)
class Key:
    """A key of an element.

    Attributes:
        names: The name, and other ones for the same.
        kind: Of its value.
        about: For people: one line.
        target: The argument of the action that it becomes. Of the keys for one target one can be given.
        required: Whether it must be there, under one of its names.
    """

    names: tuple[str, ...]
    kind: Kind
    about: str
    target: str
    required: bool = False


_CONDITIONS: Final = (
    Key(("if",), FLAG, "Only if this is true.", "condition"),
    Key(("unless",), FLAG, "Only if this is false.", "condition"),
)


@dataclass(frozen=True, kw_only=True)
class Element:
    """A kind of element.

    Attributes:
        names: The name, and other ones for the same.
        about: For people: one line.
        make: Makes the action, of the targets of the keys.
        own: Its keys, but for the conditions, which every element has.
        alternatives: Sets of targets of which exactly one must be there, all of it; none: it does not matter.
        listed: The key that gets the value if that is a list; empty: it cannot be a list.
    """

    names: tuple[str, ...]
    about: str
    make: Callable[..., Action]
    own: tuple[Key, ...]
    alternatives: tuple[tuple[str, ...], ...] = ()
    listed: str = ""

    @property
    def keys(self) -> tuple[Key, ...]:
        """All its keys."""
        return (*self.own, *_CONDITIONS)

    def read(self, value: object, spot: Spot) -> Action:
        """Return the action that it is.

        Raises:
            DocumentError: Something in it is not as it should be.
        """
        if self.listed and isinstance(value, list):
            alone = next(key for key in self.own if self.listed in key.names)
            return _placed(self.make(**{alone.target: alone.kind.read(cast("object", value), spot)}), spot)
        body = read_mapping({} if value is None else value, spot)
        by_name = {name: key for key in self.keys for name in key.names}
        values: dict[str, Any] = {}
        given: dict[str, str] = {}
        for name, each in body.items():
            key = by_name.get(name)
            if key is None:
                hint = did_you_mean(name, by_name) or f"; there is {', '.join(sorted(by_name))}"
                raise spot.inner(name).error(f"no such key{hint}")
            if key.target in given:
                raise spot.error(f"'{given[key.target]}' and '{name}' cannot both be there")
            given[key.target] = name
            values[key.target] = _value(key, each, spot.inner(name))
        self._check(values, spot)
        return _placed(self.make(**values), spot)

    def _check(self, values: Mapping[str, Any], spot: Spot) -> None:
        for key in self.keys:
            if key.required and key.target not in values:
                raise spot.error(f"'{key.names[0]}' is missing")
        if not self.alternatives:
            return
        begun = [targets for targets in self.alternatives if not values.keys().isdisjoint(targets)]
        if len(begun) != 1 or not values.keys() >= set(begun[0]):
            texts = [
                " and ".join(self._key(each).names[0] for each in targets) for targets in self.alternatives
            ]
            raise spot.error(f"one of these should be there: {'; '.join(texts)}")

    def _key(self, target: str) -> Key:
        return next(key for key in self.keys if key.target == target)

    def schema(self) -> Schema:
        """Return its JSON schema."""
        properties = {
            name: {**key.kind.schema(), "description": key.about} for key in self.keys for name in key.names
        }
        made: Schema = {"type": "object", "properties": properties, "additionalProperties": False}
        rules = list(self._rules())
        if rules:
            made["allOf"] = rules
        needed = any(key.required for key in self.own) or self.alternatives
        shapes = [made]
        if self.listed:
            shapes.append(properties[self.listed])
        if not needed:
            shapes.append({"type": "null"})
        whole = made if len(shapes) == 1 else {"anyOf": shapes}
        return {"description": self.about, **whole}

    def _rules(self) -> Iterator[Schema]:
        """Yield what there is to say beyond single keys: what must be there, and what excludes each other."""
        names: dict[str, list[str]] = {}
        for key in self.keys:
            names.setdefault(key.target, []).extend(key.names)
        for key in self.own:
            if key.required:
                yield _given(names[key.target])
        for each in names.values():
            for at, name in enumerate(each):
                yield from ({"not": {"required": [name, other]}} for other in each[at + 1 :])
        if self.alternatives:
            given = [[_given(names[target]) for target in targets] for targets in self.alternatives]
            yield {"oneOf": [{"anyOf": each} for each in given]}
            yield {"anyOf": [{"allOf": each} for each in given]}


def _placed(action: Action, spot: Spot) -> Action:
    """Return an action that knows its place in the document."""
    object.__setattr__(action, "place", spot.place)
    return action


def _given(names: list[str]) -> Schema:
    """Return the schema of a mapping that has one of these keys."""
    return {"required": names} if len(names) == 1 else {"anyOf": [{"required": [name]} for name in names]}


def _value(key: Key, value: object, spot: Spot) -> Any:
    read = key.kind.read(value, spot)
    if key.target != "condition":
        return read
    return _condition(key.names[0], read)


def _condition(word: str, value: Any) -> Condition:
    predicate = str(value).lower() if isinstance(value, bool) else value
    return IfCondition(predicate) if word == "if" else UnlessCondition(predicate)
