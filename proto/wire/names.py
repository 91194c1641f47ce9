"""Validation and expansion of node, topic and service names, by ROS 2's rules (ASCII only).

One regular expression recognises a valid name. Only an invalid one is checked rule by rule, to report which
rule it breaks and at which character. Errors are the `InvalidNameError` family of `proto.errors`; a name that
is not a `str` raises `TypeError`.

    unexpanded   chatter, ~/chatter, {ns}/chatter     as written in programs and on the command line
    full         /ns/chatter                          as sent on the wire: absolute and expanded
"""

from __future__ import annotations

import re
from typing import Final

from proto.errors import (
    InvalidNameError,
    InvalidNamespaceError,
    InvalidNodeNameError,
    InvalidServiceNameError,
    InvalidTopicNameError,
)

MAX_NODE_NAME_LENGTH: Final = 255
"""Characters in a node name, as in ROS 2."""
MAX_TOPIC_NAME_LENGTH: Final = 247
"""Characters in a full topic or service name: ROS 2 reserves 8 of DDS's 255 for its prefixes."""
MAX_NAMESPACE_LENGTH: Final = MAX_TOPIC_NAME_LENGTH - 2
"""Characters in a namespace, so that a slash and one more character still make a topic name."""

_NODE_NAME = re.compile(r"[A-Za-z_][A-Za-z0-9_]*")
_FULL_NAME = re.compile(r"(?:/[A-Za-z_][A-Za-z0-9_]*)+")
_USUAL_TOPIC_NAME = re.compile(r"(?:~?/)?[A-Za-z_][A-Za-z0-9_]*(?:/[A-Za-z_][A-Za-z0-9_]*)*")
_SUBSTITUTION = re.compile(r"\{([^{}]*)\}")

_Rule = tuple[str, re.Pattern[str]]
"""A rule in words (KIND stands for the kind of name), and a pattern whose group `at` marks a violation."""
_Rules = tuple[tuple[_Rule, ...], ...]
"""Groups of rules, checked in order; within a group the first violation in the name is reported."""


def _rule(reason: str, pattern: str) -> _Rule:
    return reason, re.compile(pattern, re.ASCII | re.DOTALL)


def _length_rule(limit: int) -> tuple[_Rule]:
    pattern = rf"\A.{{{limit - 1}}}(?P<at>.)(?=.)"
    return (_rule(f"KIND must not be longer than {limit} characters", pattern),)


_EMPTY = (_rule("KIND must not be empty", r"\A(?P<at>)\Z"),)
_TRAILING_SLASH = (_rule("KIND must not end with a '/'", r"(?P<at>/)\Z"),)

_NODE_NAME_RULES: _Rules = (
    _EMPTY,
    (_rule("KIND must not contain characters other than alphanumerics or '_'", r"(?P<at>\W)"),),
    (_rule("KIND must not start with a number", r"\A(?P<at>\d)"),),
    _length_rule(MAX_NODE_NAME_LENGTH),
)
_FULL_NAME_RULES: _Rules = (
    _EMPTY,
    (_rule("KIND must be absolute, it must lead with a '/'", r"\A(?P<at>[^/])"),),
    _TRAILING_SLASH,
    (_rule("KIND must not contain characters other than alphanumerics, '_', or '/'", r"(?P<at>[^\w/])"),),
    (
        _rule("KIND must not contain repeated '/'", r"/(?P<at>/)"),
        _rule("KIND must not have a token that starts with a number", r"/(?P<at>\d)"),
    ),
)
_NAMESPACE_RULES: _Rules = (*_FULL_NAME_RULES, _length_rule(MAX_NAMESPACE_LENGTH))
_TOPIC_NAME_RULES: _Rules = (*_FULL_NAME_RULES, _length_rule(MAX_TOPIC_NAME_LENGTH))
_UNEXPANDED_RULES: _Rules = (
    _EMPTY,
    (_rule("KIND token must not start with a number", r"\A(?P<at>\d)"),),
    _TRAILING_SLASH,
    (
        _rule("substitution name must not start with a number", r"\{(?P<at>\d)"),
        _rule(
            "substitution name must not contain characters other than alphanumerics or '_'",
            r"\{\w*(?P<at>[^\w}])",
        ),
        _rule("KIND must not have unmatched (unbalanced) curly braces '{}'", r"(?P<at>\{)\w*\Z"),
        _rule(
            "KIND must not have unmatched (unbalanced) curly braces '{}'",
            r"\A(?:[^{}]|\{\w*\})*+(?P<at>\})",
        ),
        _rule("KIND must not have tilde '~' unless it is the first character", r"(?<!\A)(?P<at>~)"),
        _rule(
            "KIND must not contain characters other than alphanumerics, '_', '~', '{', or '}'",
            r"(?P<at>[^\w/~{}])",
        ),
    ),
    (
        _rule(
            "KIND must not have a tilde '~' that is not followed by a forward slash '/'", r"\A~(?P<at>[^/])"
        ),
        _rule("KIND token must not start with a number", r"/(?P<at>\d)"),
    ),
)


def validate_node_name(name: str) -> None:
    """Check a node name without its namespace.

    Raises:
        InvalidNodeNameError: It is empty, has a character other than letters, digits and `_`, starts with a
            digit, or is longer than `MAX_NODE_NAME_LENGTH`.
    """
    _require_str("node name", name)
    if not _NODE_NAME.fullmatch(name) or len(name) > MAX_NODE_NAME_LENGTH:
        _check(name, _NODE_NAME_RULES, "node name", InvalidNodeNameError)


def validate_namespace(namespace: str) -> None:
    """Check a full namespace: `/`, or a full topic name of at most `MAX_NAMESPACE_LENGTH` characters.

    Raises:
        InvalidNamespaceError: It is invalid. `normalize_namespace` adds a missing first slash.
    """
    _require_str("namespace", namespace)
    if namespace == "/":
        return
    if not _FULL_NAME.fullmatch(namespace) or len(namespace) > MAX_NAMESPACE_LENGTH:
        _check(namespace, _NAMESPACE_RULES, "namespace", InvalidNamespaceError)


def validate_full_topic_name(name: str) -> None:
    """Check an expanded topic name, such as `/ns/chatter`.

    Raises:
        InvalidTopicNameError: It is empty, relative, ends with a slash, has a character other than letters,
            digits, `_` and `/`, an empty token, a token that starts with a digit, or is longer than
            `MAX_TOPIC_NAME_LENGTH`.
    """
    _require_str("topic name", name)
    if not _FULL_NAME.fullmatch(name) or len(name) > MAX_TOPIC_NAME_LENGTH:
        _check(name, _TOPIC_NAME_RULES, "topic name", InvalidTopicNameError)


def validate_full_service_name(name: str) -> None:
    """Check an expanded service name; the rules are those of `validate_full_topic_name`.

    Raises:
        InvalidServiceNameError: It breaks one of them.
    """
    _require_str("service name", name)
    if not _FULL_NAME.fullmatch(name) or len(name) > MAX_TOPIC_NAME_LENGTH:
        _check(name, _TOPIC_NAME_RULES, "service name", InvalidServiceNameError)


def validate_topic_name(name: str, *, is_service: bool = False) -> None:
    """Check a topic or service name before `~` and `{...}` are expanded.

    Some errors (an empty token, the length) are found only after expansion: see `expand_topic_name`.

    Raises:
        InvalidTopicNameError: It breaks a rule (`InvalidServiceNameError` if `is_service`).
    """
    kind = "service name" if is_service else "topic name"
    _require_str(kind, name)
    if not _USUAL_TOPIC_NAME.fullmatch(name):
        _check(name, _UNEXPANDED_RULES, kind, _topic_error(is_service=is_service))


def expand_topic_name(
    topic: str,
    node_name: str,
    namespace: str,
    *,
    is_service: bool = False,
    validate: bool = False,
) -> str:
    """Return the full form of a topic or service name that a node uses.

    `~` is the node's full name; `{node}`, `{ns}` and `{namespace}` are replaced; a relative name goes into
    the namespace. The result of a substitution may still break a rule (`/foo/{ns}` gives `/foo//my_ns`).

    Args:
        topic: The name.
        node_name: The node's name without its namespace.
        namespace: The node's full namespace.
        is_service: Whether `topic` is a service name.
        validate: Whether to check the result, too; otherwise the caller does.

    Raises:
        InvalidNodeNameError, InvalidNamespaceError: The node's own names are invalid.
        InvalidTopicNameError: `topic` is invalid, or has an unknown substitution
            (`InvalidServiceNameError` if `is_service`).
    """
    validate_node_name(node_name)
    validate_namespace(namespace)
    return expand_for_node(topic, node_name, namespace, is_service=is_service, validate=validate)


def expand_for_node(topic: str, node_name: str, namespace: str, *, is_service: bool, validate: bool) -> str:
    """Return what `expand_topic_name` returns, without checking the node's own names."""
    _require_str("service name" if is_service else "topic name", topic)
    # Nearly all names match this one expression; only others are checked rule by rule.
    usual = _USUAL_TOPIC_NAME.fullmatch(topic)
    if not usual:
        validate_topic_name(topic, is_service=is_service)
    full = topic
    if full.startswith("~"):
        full = full_node_name(namespace, node_name) + full[1:]
    if "{" in full:
        full = _substitute(full, topic, node_name, namespace, is_service=is_service)
    if not full.startswith("/"):
        full = full_node_name(namespace, full)
    if validate and not (usual and len(full) <= MAX_TOPIC_NAME_LENGTH):  # then its tokens are valid
        (validate_full_service_name if is_service else validate_full_topic_name)(full)
    return full


def is_hidden(name: str) -> bool:
    """Return whether a name has a token that starts with `_`; command-line tools omit such names."""
    _require_str("name", name)
    return name.startswith("_") or "/_" in name


def full_node_name(namespace: str, name: str) -> str:
    """Join a full namespace and a relative name, without a check: `/ns/name`, or `/name` in the root."""
    return f"/{name}" if namespace == "/" else f"{namespace}/{name}"


def split_node_name(full: str) -> tuple[str, str]:
    """Split a node's full name into namespace and name: `/a/b/n` gives `("/a/b", "n")`.

    Add a missing first slash. Neither part is checked.
    """
    _require_str("node name", full)
    namespace, _, name = full.rpartition("/")
    return normalize_namespace(namespace), name


def normalize_namespace(namespace: str) -> str:
    """Add a missing first slash: `""` gives `/`, `ns` gives `/ns`. Nothing is checked."""
    return namespace if namespace.startswith("/") else f"/{namespace}"


def _require_str(kind: str, name: object) -> None:
    if not isinstance(name, str):
        raise TypeError(f"{kind} must be a str, not {type(name).__name__}")


def _fault(name: str, rules: _Rules, kind: str) -> tuple[str, int] | None:
    """Return the rule that `name` breaks, in words, and the index of the invalid character."""
    for group in rules:
        faults = [(found.start("at"), reason) for reason, rule in group if (found := rule.search(name))]
        if faults:
            index, reason = min(faults, key=lambda fault: fault[0])
            return reason.replace("KIND", kind), index
    return None


def _check(name: str, rules: _Rules, kind: str, error: type[InvalidNameError]) -> None:
    fault = _fault(name, rules, kind)
    if fault is not None:
        raise error(kind, name, *fault)


def _topic_error(*, is_service: bool) -> type[InvalidNameError]:
    return InvalidServiceNameError if is_service else InvalidTopicNameError


def _substitute(full: str, topic: str, node_name: str, namespace: str, *, is_service: bool) -> str:
    values = {"node": node_name, "ns": namespace, "namespace": namespace}
    for match in _SUBSTITUTION.finditer(topic):
        if match[1] not in values:
            reason = f"unknown substitution '{match[0]}', expected {{node}}, {{ns}} or {{namespace}}"
            kind = "service name" if is_service else "topic name"
            raise _topic_error(is_service=is_service)(kind, topic, reason, match.start())
    return _SUBSTITUTION.sub(lambda match: values[match[1]], full)
