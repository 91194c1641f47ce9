"""Finds interface classes by ROS name, and renders their text.

The order of the search: classes that this program has defined, callboard's standard packages, importable
packages with the layout of `generate`'s output, and packages of files, if the process can import these
(`file_packages`), and those that ROS 2 has installed (`share_packages`). A name may come from another
machine, so only packages with the right folder are imported.
"""

from __future__ import annotations

import difflib
import re
import sys
from importlib import import_module
from typing import TYPE_CHECKING, Any, Final, cast

from actors.interfaces.catalog import (
    interfaces_of,
    is_standard,
    known_packages,
    python_package,
    shared_file,
    shared_module,
    source_file,
    standard_packages,
    unknown_package,
)
from actors.interfaces.comments import comments_of
from actors.interfaces.errors import InterfaceSyntaxError, UnknownInterfaceError
from actors.interfaces.fields import FieldType, constants_of, fields_of
from actors.interfaces.message import Action, Message, Service, type_name
from actors.interfaces.specs import PARTS, ConstantSpec, FieldSpec, InterfaceSpec, MessageSpec, interface_text

if TYPE_CHECKING:
    from collections.abc import Iterator

    import msgspec

_NAME: Final = re.compile(r"([a-z][a-z0-9_]*)/(?:(msg|srv|action)/)?([A-Z][A-Za-z0-9]*)")
_EVENT: Final = "_Event"
_BASES: Final[dict[str, type]] = {"msg": Message, "srv": Service, "action": Action}


def _defined(base: type[Any]) -> Iterator[type[Any]]:
    subclasses: list[type[Any]] = base.__subclasses__()
    for cls in subclasses:
        yield cls
        yield from _defined(cls)


def _has_finder() -> bool:
    """Return whether this process can import interface packages from their files."""
    # Not imported here, which takes some milliseconds: without it nobody has installed its finder.
    file_packages = sys.modules.get("actors.interfaces.file_packages")
    return file_packages is not None and bool(file_packages.has_finder())


def defined_interface(name: str) -> type | None:
    """Return the class of an interface that this program has defined or imported; None if there is none.

    Args:
        name: The full name.
    """
    defined = _defined(_BASES[name.split("/")[1]])
    return next((cls for cls in defined if type_name(cls) == name), None)


def _module_of(package: str, kind: str, name: str) -> str | None:
    """Return the name of the module that has the class of an interface, or makes it."""
    if shared_file(package, kind, name) is not None:
        return shared_module(package, kind, name)
    module = python_package(package, kind)
    if module is None and _has_finder() and source_file(package, kind, name) is not None:
        return f"{package}.{kind}"
    return module


def _load(package: str, kind: str, name: str) -> type | None:
    full = f"{package}/{kind}/{name}"
    # The program's own classes first. A second class for the same name would not match the one that the
    # program uses.
    defined = defined_interface(full)
    if defined is not None:
        return defined
    module = _module_of(package, kind, name)
    if module is None:
        return None
    try:
        # Only from packages with the layout of generated ones (`python_package`): the name may come from a
        # graph, and an import runs code.
        found = getattr(import_module(module), name, None)
    except (ImportError, SyntaxError, InterfaceSyntaxError, OSError) as error:
        raise UnknownInterfaceError(f"Interface '{full}' cannot be imported: {error}") from error
    return found if isinstance(found, type) and issubclass(found, _BASES[kind]) else None


def _suggestion(name: str, package: str) -> str:
    """Return "; did you mean …?" for the most similar known name, or nothing."""
    if is_standard(package):
        candidates = interfaces_of(package)
    else:
        # example_interfaces copies std_msgs; suggest the original.
        packages = sorted(standard_packages(), key=lambda each: each == "example_interfaces")
        candidates = [each for standard in packages for each in interfaces_of(standard)]
    short = {each.replace("/msg/", "/"): each for each in candidates} | {each: each for each in candidates}
    close = difflib.get_close_matches(name, short, n=1)
    if not close:
        word = name.rpartition("/")[2]
        close = [each for each in candidates if each.rpartition("/")[2].lower() == word.lower()][:1]
    return f"; did you mean {short[close[0]]}?" if close else ""


def _not_found(name: str, package: str) -> str:
    parts = name.split("/")
    for kind in PARTS if len(parts) == 2 else parts[1:2]:
        file = source_file(package, kind, parts[-1])
        if file is not None:
            folder = file.parent.parent
            return f"Interface '{name}' has no class; run 'callboard interface generate {folder}'"
    suggestion = _suggestion(name, package)
    if package in known_packages():
        word = name.removeprefix(f"{package}/")
        return f"Interface '{word}' not found in package '{package}'{suggestion}"
    return f"Unknown package '{package}'{suggestion}" if suggestion else unknown_package(package)


def _event_of(service: type[Any] | None, name: str) -> type[Message] | None:
    from actors.interfaces.service_event import service_event  # noqa: PLC0415 - seldom needed

    if service is None:
        return None
    if not issubclass(service, Service):
        raise UnknownInterfaceError(f"'{name}' is not an interface name: only services have events")
    return service_event(cast("Any", service))


def find_interface(name: str) -> type[Message | Service | Action]:
    """Return the class of an interface: "std_msgs/msg/String", "std_msgs/String", "std_srvs/srv/SetBool".

    "std_srvs/srv/SetBool_Event" is the message of that service's introspection.

    Args:
        name: The full name, or the name without its kind.

    Raises:
        UnknownInterfaceError: The name is invalid, or no such class can be imported; with a suggestion.
    """
    found = _search(name)
    if found is not None:
        return found
    name = name.removesuffix(_EVENT)
    package = name.partition("/")[0]
    if _NAME.fullmatch(name):
        raise UnknownInterfaceError(_not_found(name, package))
    hint = _suggestion(name, package) if re.fullmatch(r"[\w/]{3,255}", name) else ""
    raise UnknownInterfaceError(
        f"'{name}' is not an interface name{hint}; write package/msg/Name, such as std_msgs/msg/String"
    )


def installed_interface(name: str) -> type[Message | Service | Action] | None:
    """Return what `find_interface` returns, and None where it raises.

    For names that may well be unknown, such as those in a graph: a suggestion takes 0.1 s, a search far less.
    """
    try:
        return _search(name)
    except UnknownInterfaceError:  # it cannot be imported
        return None


def _search(name: str) -> type[Message | Service | Action] | None:
    match = _NAME.fullmatch(name)
    if match is None:
        return _event_of(_search(name.removesuffix(_EVENT)), name) if name.endswith(_EVENT) else None
    package, kind, word = match.groups()
    # Messages first: without a kind, nearly always a message is meant.
    for each in (kind,) if kind else PARTS:
        found = _load(package, each, word)
        if found is not None:
            return found
    return None


def _default_of(cls: type[Message], name: str) -> Any:
    """Return a field's default value; None if it has none."""
    index = cls.__struct_fields__.index(name) - len(cls.__struct_fields__)
    defaults: tuple[Any, ...] = cls.__struct_defaults__
    if -index > len(defaults):
        return None
    default = defaults[index]
    factory = getattr(cast("msgspec.Struct", default), "factory", None)
    return default if factory is None else factory()


def _is_zero(value: Any) -> bool:
    if isinstance(value, bytes | str) or not hasattr(value, "__len__"):
        return not value or (isinstance(value, bytes) and not any(value))
    return all(_is_zero(item) for item in value)


def _field_spec(cls: type[Message], name: str, field_type: FieldType, comment: str) -> FieldSpec:
    default = None if "/" in field_type.base else _default_of(cls, name)
    # A zero default is what ROS assumes, so that writing it would change the text and nothing else.
    return FieldSpec(name, field_type, None if default is None or _is_zero(default) else default, comment)


def _message_spec(cls: type[Message], own: str, comments: dict[str, str]) -> MessageSpec:
    return MessageSpec(
        tuple(
            _field_spec(cls, field.name, field.type, comments.get(field.name, "")) for field in fields_of(cls)
        ),
        tuple(
            ConstantSpec(name, kind, value, comments.get(name, "")) for name, kind, value in constants_of(cls)
        ),
        own,
    )


def source_of(cls: type[Message | Service | Action], *, comments: bool = False) -> str:
    """Return the `.msg`, `.srv` or `.action` text of a class, generated or hand-written.

    Args:
        cls: The class.
        comments: Whether to include its comments.

    Raises:
        TypeError: `cls` is not such a class, or one of its fields has no ROS type.
    """

    def spec_of(part: type[Message], *owners: Any) -> MessageSpec:
        if not comments:
            return _message_spec(part, "", {})
        own = (comments_of(each).own for each in (*owners, part))
        return _message_spec(part, "\n\n".join(filter(None, own)), comments_of(part).fields)

    package, kind, name = type_name(cls).split("/")
    if issubclass(cls, Message):
        return interface_text(InterfaceSpec(package, kind, name, (spec_of(cls),)))
    first, *others = (getattr(cls, part) for part in PARTS[kind])
    # What is above the first part is about the whole.
    parts = (spec_of(first, cls), *(spec_of(part) for part in others))
    return interface_text(InterfaceSpec(package, kind, name, parts))


def interface_source(name: str) -> str:
    """Return the text of an interface, without comments.

    Args:
        name: As for `find_interface`.

    Raises:
        UnknownInterfaceError: There is no such interface.
    """
    return source_of(find_interface(name))
