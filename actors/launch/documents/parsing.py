"""Parses YAML and TOML files to plain data, within limits.

Data is None, booleans, numbers, strings, lists, and mappings from strings to data. In YAML an unquoted string
is `PlainText`, a number knows how it is written, keys are strings as they are written, and a duplicate key is
an error, as in TOML.
"""

from __future__ import annotations

import tomllib
from typing import Any, Final, cast

from actors.interfaces.yaml_reader import MERGE_TAG, PLAIN_TAG, PlainText, YamlError, parse_yaml, yaml_error
from actors.launch.documents.errors import DocumentError, Location
from proto.untrusted_text import escape

MAX_DEPTH: Final = 50
"""Levels of lists and mappings."""
MAX_VALUES: Final = 100_000
"""In a document; with aliases a small file can have any number of them."""


class WrittenInt(int):
    """An integer of a YAML file that knows how it is written there.

    For an option that is a string, `default: 010` is "010" and not "8". Options are known only later.

    Attributes:
        written: The string in the file.
    """

    written: str


class WrittenFloat(float):
    """A number that is no integer, as `WrittenInt`.

    Attributes:
        written: The string in the file.
    """

    written: str


_YAML: Final = "tag:yaml.org,2002:"
_TEXTS: Final = frozenset(f"{_YAML}{kind}" for kind in ("str", "timestamp", "value"))
_SCALARS: Final = frozenset((PLAIN_TAG, *(f"{_YAML}{kind}" for kind in ("null", "bool", "int", "float"))))


def toml_data(source: bytes) -> object:
    """Return the data of a TOML file.

    Raises:
        DocumentError: It is not TOML, or exceeds a limit.
    """
    try:
        data: object = tomllib.loads(source.decode("utf-8"))
    except UnicodeDecodeError:
        raise Location().error("it is not UTF-8") from None
    except ValueError as error:
        raise Location().error(f"it is not TOML: {error}") from None
    except RecursionError:
        raise Location().error("it is nested too deeply") from None
    # The readers of the data are recursive.
    _require_shallow(data, Location())
    return data


def _require_shallow(data: object, location: Location) -> None:
    if isinstance(data, dict | list):
        if len(location.path) == MAX_DEPTH:
            raise location.error(_TOO_DEEP)
        below: Any = cast("Any", data)
        for key, each in below.items() if isinstance(data, dict) else enumerate(below):
            _require_shallow(each, location.inner(key))


def yaml_data(source: bytes) -> object:
    """Return the data of a YAML file.

    Raises:
        DocumentError: It is not YAML, or exceeds a limit.
    """
    import yaml  # noqa: PLC0415 - takes time, and Python and TOML files do not need it

    try:
        return _Builder(source).data()
    except YamlError as error:
        raise DocumentError(error.problem, Location(), error.line) from None
    except yaml.YAMLError as error:
        found = yaml_error(error)
        raise DocumentError(f"it is not YAML: {found.problem}", Location(), found.line) from None


def yaml_line(source: bytes, location: Location) -> int | None:
    """Return the line, from 1, of a location in a YAML file that `yaml_data` has read."""
    return _Builder(source).line(location)


class _Builder:
    """Builds data from the nodes of a YAML file, which have lines."""

    def __init__(self, source: bytes) -> None:
        self._loader, self._root = parse_yaml(source, max_depth=MAX_DEPTH)
        self._values = 0

    def data(self) -> object:
        """Return the data of the whole file."""
        return None if self._root is None else self._value(self._root, Location())

    def _value(self, node: Any, location: Location) -> object:
        # Each use of an alias counts: ten levels of ten aliases would be 10^10 values in a small file.
        self._values += 1
        if self._values > MAX_VALUES:
            raise DocumentError(f"the file has more than {MAX_VALUES} values", Location())
        if node.id == "scalar":
            return self._scalar(node, location)
        if node.tag != f"{_YAML}{'map' if node.id == 'mapping' else 'seq'}":
            raise _error(f"the tag {escape(node.tag)} is not known here", node, location)
        if node.id == "sequence":
            return [self._value(each, location.inner(at)) for at, each in enumerate(node.value)]
        return self._mapping(node, location)

    def _scalar(self, node: Any, location: Location) -> object:
        # A date would be a value that no option has, and `=` is a tag of YAML 1.1 that nobody means.
        if node.tag in _TEXTS:
            return node.value
        if node.tag not in _SCALARS:
            raise _error(f"the tag {escape(node.tag)} is not known here", node, location)
        try:
            value = self._loader.construct_object(node)
        except YamlError as error:
            raise _error(error.problem, node, location) from None
        if node.tag != PLAIN_TAG or value is None or isinstance(value, bool):
            return value
        # Parameters need to know that a string has no quotes.
        if isinstance(value, str):
            return PlainText(value)
        number = WrittenInt(value) if isinstance(value, int) else WrittenFloat(value)
        number.written = node.value
        return number

    def _mapping(self, node: Any, location: Location) -> dict[str, object]:
        made: dict[str, object] = {}
        merged: dict[str, object] = {}
        for key, each in node.value:
            # Keys are names of elements, options and parameters.
            if key.id != "scalar":
                raise _error("a key must be a string", key, location)
            name: str = key.value  # as it is written: `on` and `010` are names, no values
            if key.tag == MERGE_TAG:
                merged = {**self._merged(each, location.inner(name)), **merged}
            # YAML parsers usually take the last one in silence.
            elif name in made:
                raise _error(f"the key '{escape(name)}' is there twice", key, location)
            else:
                made[name] = self._value(each, location.inner(name))
        return {**merged, **made}  # keys of the mapping itself win over merged ones, wherever they are

    def _merged(self, node: Any, location: Location) -> dict[str, object]:
        """Return what `<<` takes in: a mapping, or several, of which earlier ones count."""
        value = self._value(node, location)
        found: dict[str, object] = {}
        for each in cast("list[object]", value) if isinstance(value, list) else [value]:
            if not isinstance(each, dict):
                raise _error("<< takes mappings only", node, location)
            for name, merged in cast("dict[str, object]", each).items():
                found.setdefault(name, merged)
        return found

    def line(self, location: Location) -> int | None:
        """Return the line of a location; for a merged value, the line of the mapping around it."""
        node = self._root
        line: int | None = None
        for step in location.path:
            if node is None or node.id == "scalar":
                break
            if node.id == "sequence":
                node = node.value[cast("int", step)]
                line = node.start_mark.line + 1
                continue
            found = [(key, each) for key, each in node.value if key.value == step]
            if not found:
                break  # a merged value: its mapping is somewhere else
            key, node = found[0]
            line = key.start_mark.line + 1
        return line


_TOO_DEEP: Final = f"it is nested deeper than {MAX_DEPTH}"


def _error(text: str, node: Any, location: Location) -> DocumentError:
    return DocumentError(text, location, node.start_mark.line + 1)
