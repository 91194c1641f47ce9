"""YAML from files, arguments and stdin, read within limits: the only place that loads YAML.

PyYAML itself has no limits: it recurses for each level of nesting, an alias costs nothing to write and any
amount to read, merging mappings and converting long numbers takes quadratic time, and a tag that does not fit
its value raises whatever Python raises.
"""

from __future__ import annotations

from functools import cache, partial
from typing import TYPE_CHECKING, Any, Final

from actors.interfaces.yaml_scalars import MAX_NUMBER_CHARS, yaml_scalar
from proto.errors import CallboardError
from proto.untrusted_text import escape

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator

    Rules = Callable[[str], object]

MAX_BYTES: Final = 16 * 1024 * 1024
"""Size of a document."""
MAX_DEPTH: Final = 100
"""Levels of lists and mappings."""
MAX_ALIASED: Final = 100_000
"""Values that aliases add to those that are written."""
MAX_MERGES: Final = 1000
"""Mappings merged with `<<`, in a document."""
PLAIN_TAG: Final = "!plain"
MERGE_TAG: Final = "tag:yaml.org,2002:merge"
_TEXT_TAG: Final = "tag:yaml.org,2002:str"
_INTEGERS: Final = range(-(2**63), 2**64)
"""Integers that a message or a parameter can hold."""
_QUOTED_CHARS: Final = 60

_CONSTRUCTION_ERRORS: Final = (
    ArithmeticError,
    AttributeError,
    LookupError,
    RecursionError,
    TypeError,
    ValueError,
)
"""Exceptions of PyYAML's constructors for a tag or a form that does not fit the value."""


class YamlError(CallboardError, ValueError):
    """A text is not YAML, or is beyond a limit.

    Attributes:
        problem: What is wrong.
        line: Where, from 1; None if it is unknown.
    """

    def __init__(self, problem: str, line: int | None = None) -> None:
        super().__init__(problem if line is None else f"line {line}: {problem}")
        self.problem = problem
        self.line = line


class PlainText(str):
    """An unquoted scalar as it is written. As `rules` it leaves conversion to code that knows the type."""

    __slots__ = ()


def load_yaml(
    source: str | bytes,
    *,
    rules: Rules = yaml_scalar,
    max_bytes: int = MAX_BYTES,
    max_depth: int = MAX_DEPTH,
) -> object:
    """Return the data of a YAML document; keys of mappings are texts as they are written.

    Args:
        source: The document; bytes are UTF-8 or UTF-16.
        rules: What unquoted scalars are: a function of `yaml_scalars`, or `PlainText`.
        max_bytes: Its largest size, in bytes or characters.
        max_depth: Levels of lists and mappings.

    Returns:
        Plain data; None for an empty document.

    Raises:
        YamlError: It is not YAML, or beyond a limit.
    """
    import yaml  # noqa: PLC0415 - slow to import, and not every program reads YAML

    if len(source) > max_bytes:
        raise YamlError(f"larger than {max_bytes} bytes")
    try:
        loader, root = parse_yaml(source, rules=rules, max_depth=max_depth)
        return None if root is None else loader.construct_document(root)
    except YamlError:
        raise
    except yaml.YAMLError as error:
        raise yaml_error(error) from None
    # A program must be able to report a bad file as such, whatever PyYAML raises for it.
    except _CONSTRUCTION_ERRORS as error:
        raise YamlError(escape(str(error))[:_QUOTED_CHARS]) from None


def yaml_events(source: str | bytes) -> Iterator[Any]:
    """Yield the parse events of YAML: the quickest way to read it, without aliases and tags.

    The caller limits the depth.

    Args:
        source: The documents; bytes are UTF-8 or UTF-16.

    Raises:
        YamlError: It is not YAML.
    """
    import yaml  # noqa: PLC0415 - see above

    try:
        loader = _base_loader()(source)
        while (event := loader.get_event()) is not None:
            yield event
            if type(event) is yaml.StreamEndEvent:
                return
    except yaml.YAMLError as error:
        raise yaml_error(error) from None
    except UnicodeError as error:
        raise YamlError(f"it is not Unicode: {error}") from None


def parse_yaml(
    source: str | bytes, *, rules: Rules = yaml_scalar, max_depth: int = MAX_DEPTH
) -> tuple[Any, Any]:
    """Return a loader and the document's root node, whose size and depth are within the limits.

    Nodes of unquoted scalars have the tag `PLAIN_TAG`, except for `<<`.

    Raises:
        YamlError: A limit is exceeded.
        yaml.YAMLError: It is not YAML.
    """
    import yaml  # noqa: PLC0415 - see above

    loader_type = _loader_type(rules)
    is_text = isinstance(source, str)
    marks: Any = "[{-?:" if is_text else (b"[", b"{", b"-", b"?", b":")
    # Cheap, and enough to pass nearly every document: without that many marks it cannot be nested so
    # deeply. Only the others are parsed once more, by events, which need no recursion.
    if sum(source.count(mark) for mark in marks) > max_depth:
        try:
            deep = deeper_than(max_depth, yaml.parse(source, Loader=loader_type))
        except yaml.YAMLError as error:
            found = yaml_error(error)
            if "nesting" not in found.problem:
                raise
            # libyaml has a limit of its own, which it may reach before it has returned the first event.
            raise YamlError(f"it is nested deeper than {max_depth}", found.line) from None
        if deep is not None:
            raise too_deep(max_depth, deep)
    loader = loader_type(source)
    root = loader.get_single_node()
    alias: Any = "*" if is_text else b"*"
    merge: Any = "<<" if is_text else b"<<"
    if root is not None and (alias in source or merge in source):
        _Expansion(max_depth).check(root)
    return loader, root


def too_deep(max_depth: int, found: Any) -> YamlError:
    """Return the error about a node or an event that is nested too deeply."""
    return _fail(found, f"it is nested deeper than {max_depth}")


def yaml_error(error: Exception) -> YamlError:
    """Return PyYAML's error with one short line of text."""
    mark = getattr(error, "problem_mark", None)
    problem = getattr(error, "problem", None) or getattr(error, "reason", None) or str(error)
    return YamlError(escape(" ".join(problem.split()))[:500], None if mark is None else mark.line + 1)


def deeper_than(levels: int, events: Iterable[Any]) -> Any:
    """Return the first event that is nested too deeply, or None.

    Args:
        levels: The levels that are allowed.
        events: PyYAML's parse events.
    """
    depth = 0
    for event in events:
        kind = type(event).__name__
        if kind in {"SequenceStartEvent", "MappingStartEvent"}:
            depth += 1
            if depth > levels:
                return event
        elif kind in {"SequenceEndEvent", "MappingEndEvent"}:
            depth -= 1
    return None


class _Expansion:
    """The size of a document with each alias replaced by its value."""

    def __init__(self, max_depth: int) -> None:
        self._max_depth = max_depth
        # By node: an alias refers to the same node, which is measured once. Measuring it each time would
        # take the very time that this class is to save.
        self._known: dict[int, tuple[int, int]] = {}
        self._open: set[int] = set()
        self._aliased = 0
        self._merges = 0

    def check(self, root: Any) -> None:
        """Raise YamlError if the document is too large or too deep."""
        self._measure(root, 0)

    def _measure(self, node: Any, level: int) -> tuple[int, int]:
        """Return how many values a node has with its aliases replaced, and how many levels."""
        if node.id == "scalar":
            return 1, 0
        if id(node) in self._open:
            raise _fail(node, "an alias is part of its own value")
        measured = self._known.get(id(node))
        if measured is not None:
            self._aliased += measured[0]
            if self._aliased > MAX_ALIASED:
                raise _fail(node, f"aliases add more than {MAX_ALIASED} values")
        else:
            self._open.add(id(node))
            measured = self._measure_children(node, level)
            self._open.discard(id(node))
            self._known[id(node)] = measured
        # An alias may bring a value to a greater depth than that at which it is written.
        if level + measured[1] > self._max_depth:
            raise too_deep(self._max_depth, node)
        return measured

    def _measure_children(self, node: Any, level: int) -> tuple[int, int]:
        size, depth = 1, 0
        children = node.value
        if node.id == "mapping":
            self._merges += sum(key.tag == MERGE_TAG for key, _ in node.value)
            if self._merges > MAX_MERGES:
                raise _fail(node, f"more than {MAX_MERGES} merged mappings")
            children = [each for pair in node.value for each in pair]
        for child in children:
            more, levels = self._measure(child, level + 1)
            size, depth = size + more, max(depth, levels)
        return size, depth + 1


@cache
def _base_loader() -> Any:
    import yaml  # noqa: PLC0415 - see above

    return getattr(yaml, "CSafeLoader", yaml.SafeLoader)


@cache
def _loader_type(rules: Rules) -> Any:
    """Return PyYAML's safe loader with other rules, errors that have a line, and limited numbers."""
    base = _base_loader()
    overridden = {
        "resolve": _resolve,
        "construct_object": _construct_object,
        "construct_mapping": _construct_mapping,
    }
    loader_type: Any = type("Loader", (base,), overridden)
    loader_type.add_constructor(PLAIN_TAG, partial(_construct_plain, rules))
    for kind in ("int", "float"):
        construct = getattr(base, f"construct_yaml_{kind}")
        loader_type.add_constructor(f"tag:yaml.org,2002:{kind}", partial(_construct_number, construct))
    return loader_type


def _resolve(loader: Any, kind: Any, value: Any, implicit: Any) -> Any:
    if kind.__name__ == "ScalarNode" and implicit[0]:
        return MERGE_TAG if value == "<<" else PLAIN_TAG
    return _base_loader().resolve(loader, kind, value, implicit)


def _construct_object(loader: Any, node: Any, deep: bool = False) -> object:  # noqa: FBT001, FBT002 - PyYAML's
    try:
        return _base_loader().construct_object(loader, node, deep)
    except YamlError:
        raise
    except _CONSTRUCTION_ERRORS:
        if node.id != "scalar":
            raise
        raise _fail(node, f"'{escape(node.value[:_QUOTED_CHARS])}' is not what its tag says") from None


def _construct_mapping(loader: Any, node: Any, deep: bool = False) -> object:  # noqa: FBT001, FBT002 - PyYAML's
    if node.id == "mapping":
        # First, because it brings in keys of other mappings.
        loader.flatten_mapping(node)
        for key, _ in node.value:
            if key.tag == PLAIN_TAG:
                key.tag = _TEXT_TAG
    return _base_loader().construct_mapping(loader, node, deep)


def _construct_plain(rules: Rules, _loader: Any, node: Any) -> object:
    return _in_range(rules(node.value), node)


def _construct_number(construct: Any, loader: Any, node: Any) -> object:
    # Before the conversion, which takes quadratic time for long numbers.
    if len(loader.construct_scalar(node)) > MAX_NUMBER_CHARS:
        raise _fail(node, f"a number of more than {MAX_NUMBER_CHARS} characters")
    return _in_range(construct(loader, node), node)


def _in_range(value: object, node: Any) -> object:
    if isinstance(value, int) and value not in _INTEGERS:
        raise _fail(node, f"the number {node.value} is out of range")
    return value


def _fail(node: Any, problem: str) -> YamlError:
    return YamlError(problem, node.start_mark.line + 1)
