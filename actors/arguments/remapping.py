"""Remapping rules `from:=to`, which rename nodes, namespaces, topics and services.

foo:=bar                    topic or service, both sides expanded by the node
rostopic://foo:=bar         only topics; rosservice:// only services
__node:=name  __ns:=/ns     the node's own names (`__name` is the same as `__node`)
talker:foo:=bar             only for the node named `talker`
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from typing import TYPE_CHECKING, Final

from proto.wire.names import expand_for_node, validate_namespace, validate_node_name, validate_topic_name

if TYPE_CHECKING:
    from collections.abc import Iterable

_EXPECTED: Final = "expected from:=to, such as chatter:=news, __node:=name, __ns:=/ns or talker:chatter:=news"


class RemapKind(Enum):
    """The kind of name that a rule changes."""

    TOPIC_OR_SERVICE = "topic or service"
    TOPIC = "topic"
    SERVICE = "service"
    NODE = "node"
    NAMESPACE = "namespace"


_SCHEMES: Final = {"rostopic://": RemapKind.TOPIC, "rosservice://": RemapKind.SERVICE}
_SPECIAL: Final = {"__node": RemapKind.NODE, "__name": RemapKind.NODE, "__ns": RemapKind.NAMESPACE}


@dataclass(frozen=True, kw_only=True, slots=True)
class RemapRule:
    """One rule as written; the node that applies it expands its names."""

    kind: RemapKind
    replacement: str
    match: str = ""
    """The topic or service to rename; empty for node and namespace rules."""
    node: str | None = None
    """Name of the node that it applies to; None for all."""

    @classmethod
    def parse(cls, text: str) -> RemapRule:
        """Return the rule of a command line.

        Raises:
            ValueError: The text is not a rule.
            InvalidNameError: A name in it is invalid.
        """
        left, separator, replacement = text.partition(":=")
        if not (separator and left and replacement):
            raise ValueError(_EXPECTED)
        node = None
        if not left.startswith(tuple(_SCHEMES)):
            prefix, colon, rest = left.partition(":")
            if colon:
                node, left = prefix, rest
                validate_node_name(node)
        scheme = next((each for each in _SCHEMES if left.startswith(each)), "")
        match = left.removeprefix(scheme)
        kind = _SCHEMES.get(scheme) or _SPECIAL.get(match, RemapKind.TOPIC_OR_SERVICE)
        if kind is RemapKind.NODE:
            validate_node_name(replacement)
            return cls(kind=kind, replacement=replacement, node=node)
        if kind is RemapKind.NAMESPACE:
            validate_namespace(replacement)
            return cls(kind=kind, replacement=replacement, node=node)
        validate_topic_name(match, is_service=kind is RemapKind.SERVICE)
        validate_topic_name(replacement, is_service=kind is RemapKind.SERVICE)
        return cls(kind=kind, replacement=replacement, match=match, node=node)

    def applies_to(self, node_name: str) -> bool:
        """Return whether the rule applies to the node with this name."""
        return self.node is None or self.node == node_name


class Remapper:
    """Remaps the name and namespace of one node, and the topics and services that it uses.

    The node's own rules precede those of the process, and only the first match is applied. A rule for a
    single node is compared with its name after renaming.

    Args:
        name: The node's name in the code.
        namespace: Its full namespace in the code.
        rules: Given to this node.
        process_rules: From the command line; none for a node that does not use global arguments.

    Raises:
        InvalidNameError: A name, or a rule expanded for this node, is invalid.
    """

    def __init__(
        self,
        name: str,
        namespace: str = "/",
        *,
        rules: Iterable[RemapRule] = (),
        process_rules: Iterable[RemapRule] = (),
    ) -> None:
        ordered = (*rules, *process_rules)
        self.name = _first(ordered, RemapKind.NODE, name) or name
        self.namespace = _first(ordered, RemapKind.NAMESPACE, self.name) or namespace
        validate_node_name(self.name)
        validate_namespace(self.namespace)
        applicable = [rule for rule in ordered if rule.applies_to(self.name)]
        self._topics = self._table(applicable, RemapKind.TOPIC)
        self._services = self._table(applicable, RemapKind.SERVICE)

    def resolve_topic(self, name: str, *, only_expand: bool = False) -> str:
        """Return the full name of a topic.

        Args:
            name: Its name in the node's code.
            only_expand: Do not remap it.

        Raises:
            InvalidTopicNameError: `name` is invalid, or its expansion is.
        """
        full = expand_for_node(name, self.name, self.namespace, is_service=False, validate=True)
        return full if only_expand else self._topics.get(full, full)

    def resolve_service(self, name: str, *, only_expand: bool = False) -> str:
        """Return the full name of a service.

        Args:
            name: Its name in the node's code.
            only_expand: Do not remap it.

        Raises:
            InvalidServiceNameError: `name` is invalid, or its expansion is.
        """
        full = expand_for_node(name, self.name, self.namespace, is_service=True, validate=True)
        return full if only_expand else self._services.get(full, full)

    def _table(self, rules: list[RemapRule], kind: RemapKind) -> dict[str, str]:
        table: dict[str, str] = {}
        service = kind is RemapKind.SERVICE
        for rule in rules:
            if rule.kind in {kind, RemapKind.TOPIC_OR_SERVICE}:
                match = expand_for_node(
                    rule.match, self.name, self.namespace, is_service=service, validate=False
                )
                replacement = expand_for_node(
                    rule.replacement, self.name, self.namespace, is_service=service, validate=True
                )
                table.setdefault(match, replacement)
        return table


def _first(rules: tuple[RemapRule, ...], kind: RemapKind, node_name: str) -> str | None:
    matching = (rule.replacement for rule in rules if rule.kind is kind and rule.applies_to(node_name))
    return next(matching, None)
