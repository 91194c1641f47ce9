"""What may cross a bridge, and under which names.

    rules = Rules(allow=("/camera/**",), deny=("/camera/raw",), namespace="/robot1")
    rules.crosses("/camera/image")         # True
    rules.name_here("/camera/image")       # "/robot1/camera/image"
    rules.name_there("/robot1/camera/raw") # "/camera/raw"

Patterns are for names as the other network has them, without the namespace. `*` stands for one part of a
name and `**` for any number. A pattern for an action's name covers the action's services and topics.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Final

from actors.bridges.errors import InvalidBridgeOptionError
from actors.parameters.overrides import node_matches
from proto.errors import InvalidNameError
from proto.limits import MAX_DEPTH
from proto.untrusted_text import escape
from proto.wire.names import normalize_namespace, validate_full_topic_name, validate_namespace

MAX_PATTERNS: Final = 1000
"""Patterns in each list: every new name is compared with all of them."""
MAX_PATTERN_CHARACTERS: Final = 250
"""Characters of a wrong value in an error; names are shorter."""
MAX_DECISIONS: Final = 10_000
"""Names whose decision is kept, more than a side has at once; beyond it, all are made again."""

MAX_NODES: Final = 1000
"""Mirror nodes on one side by default; 50 are a large robot."""
MAX_ENDPOINTS: Final = 5000
"""Mirrors on one side by default. In ROS 2 one takes some 60 KiB: 300 MiB."""
_MOST_NODES: Final = 10_000
_MOST_ENDPOINTS: Final = 20_000
"""The most that can be configured: what a broker allows on one link by default."""

GLOBAL_TOPICS: Final = frozenset({"/rosout", "/parameter_events"})
"""Topics of all nodes, which have the same name on both sides: a namespace is not put before them."""
_ACTION: Final = "/_action/"


@dataclass(frozen=True, kw_only=True)
class Rules:
    """What may cross, and under which names.

    Args:
        allow: Patterns of the names that cross; empty for all.
        deny: Patterns of the names that do not cross, also if `allow` has them.
        namespace: The namespace in callboard of what the other network has; "/" for none.
        depths: Patterns of topics with the depth of their mirrors, in messages. The first match decides.
        max_nodes: Mirror nodes on each side, 1 to 10,000; further nodes are refused.
        max_endpoints: Mirrors on each side, 1 to 20,000; topics and services beyond are refused.

    Raises:
        InvalidBridgeOptionError: A pattern, the namespace or a number is invalid, or a list is too long.
    """

    allow: tuple[str, ...] = ()
    deny: tuple[str, ...] = ()
    namespace: str = "/"
    depths: tuple[tuple[str, int], ...] = ()
    max_nodes: int = MAX_NODES
    max_endpoints: int = MAX_ENDPOINTS
    _decisions: dict[str, tuple[bool, int | None]] = field(
        default_factory=dict[str, tuple[bool, int | None]], init=False, repr=False, compare=False
    )
    """By name, whether it crosses and its depth; kept because each plan asks again."""

    def __post_init__(self) -> None:
        for key, patterns in (("allow", self.allow), ("deny", self.deny), ("depths", self.depths)):
            if len(patterns) > MAX_PATTERNS:
                raise InvalidBridgeOptionError(f"{key}: at most {MAX_PATTERNS} patterns, not {len(patterns)}")
        for key, patterns in (("allow", self.allow), ("deny", self.deny)):
            for pattern in patterns:
                _require_pattern(key, pattern)
        for pattern, depth in self.depths:
            _require_pattern("depths", pattern)
            require_number(f"depths: the depth of {pattern}", depth, 1, MAX_DEPTH)
        require_number("max_nodes", self.max_nodes, 1, _MOST_NODES)
        require_number("max_endpoints", self.max_endpoints, 1, _MOST_ENDPOINTS)
        namespace = normalize_namespace(self.namespace.rstrip("/"))
        try:
            validate_namespace(namespace)
        except InvalidNameError as error:
            raise InvalidBridgeOptionError(f"namespace: {error}") from None
        object.__setattr__(self, "namespace", namespace)

    @property
    def prefix(self) -> str:
        """The namespace as a prefix of names: "/robot1", or "" for none."""
        return "" if self.namespace == "/" else self.namespace

    def crosses(self, name: str) -> bool:
        """Return whether a topic or service may cross.

        Args:
            name: Its full name in the other network.
        """
        return self._decision(name)[0]

    def depth_of(self, name: str) -> int | None:
        """Return the depth that a rule sets for a topic's mirrors; None if no rule does.

        Args:
            name: The topic's full name in the other network.
        """
        return self._decision(name)[1]

    def _decision(self, name: str) -> tuple[bool, int | None]:
        decision = self._decisions.get(name)
        if decision is None:
            if len(self._decisions) >= MAX_DECISIONS:
                self._decisions.clear()
            depth = next((depth for pattern, depth in self.depths if node_matches(pattern, name)), None)
            decision = self._decisions[name] = (self._may_cross(name), depth)
        return decision

    def _may_cross(self, name: str) -> bool:
        names = [name]
        if _ACTION in name:
            names.append(name.partition(_ACTION)[0])
        return not _any_matches(self.deny, names) and (not self.allow or _any_matches(self.allow, names))

    def name_here(self, name: str) -> str:
        """Return callboard's name of a topic or service of the other network."""
        return name if name in GLOBAL_TOPICS else self.prefix + name

    def name_there(self, name: str) -> str | None:
        """Return the other network's name of a topic or service of callboard; None if it cannot cross.

        It cannot if it is outside the namespace.
        """
        prefix = self.prefix
        if not prefix or name in GLOBAL_TOPICS:
            return name
        if not name.startswith(f"{prefix}/"):
            return None
        inner = name[len(prefix) :]
        # /rosout of both sides is the same topic, so that /robot1/rosout of callboard is another one.
        return None if inner in GLOBAL_TOPICS else inner

    def node_here(self, name: str) -> str:
        """Return callboard's name of a node of the other network, before conflicts."""
        return self.prefix + name

    def node_there(self, name: str) -> str:
        """Return the other network's name of a node of callboard, before conflicts.

        Nodes outside the namespace keep their name.
        """
        prefix = self.prefix
        return name[len(prefix) :] if prefix and name.startswith(f"{prefix}/") else name


def action_of(name: str) -> str:
    """Return the name of the action that a topic or service belongs to, "" if it belongs to none."""
    return name.partition(_ACTION)[0] if _ACTION in name else ""


def parse_depth(text: str) -> tuple[str, int]:
    """Return the pattern and the depth of an option on the command line, such as "/camera/**=1".

    Args:
        text: The option's value.

    Raises:
        InvalidBridgeOptionError: It has another form.
    """
    pattern, _, digits = text.rpartition("=")
    if not pattern or not (digits.isascii() and digits.isdigit() and len(digits) <= len(str(MAX_DEPTH))):
        shown = escape(text)[:MAX_PATTERN_CHARACTERS]
        raise InvalidBridgeOptionError(f"expected a pattern and a depth, such as /camera/**=1, not '{shown}'")
    return pattern, int(digits)


def require_number(name: str, value: object, least: int, most: int) -> None:
    """Check that an option is an integer in a range.

    Args:
        name: The name of the option.
        value: Its value.
        least: The smallest allowed value.
        most: The largest allowed value.

    Raises:
        InvalidBridgeOptionError: The value is not an int, or out of the range.
    """
    # Not isinstance: in Python `true` is an integer, too.
    if type(value) is not int or not least <= value <= most:
        shown = escape(repr(value))[:MAX_PATTERN_CHARACTERS]  # with the quotes of a string
        raise InvalidBridgeOptionError(f"{name} must be an integer from {least} to {most}, not {shown}")


def _any_matches(patterns: tuple[str, ...], names: list[str]) -> bool:
    return any(node_matches(pattern, name) for pattern in patterns for name in names)


def _require_pattern(key: str, pattern: str) -> None:
    """Raise InvalidBridgeOptionError if a value is not a pattern."""
    parts = pattern.split("/")
    try:
        validate_full_topic_name("/".join("x" if part in {"*", "**"} else part for part in parts))
    except InvalidNameError:
        shown = escape(pattern)[:MAX_PATTERN_CHARACTERS]
        text = (
            "it is a full name, such as /camera/image, with '*' for one part or '**' for any number of parts"
        )
        raise InvalidBridgeOptionError(f"{key}: '{shown}' is not a pattern: {text}") from None
