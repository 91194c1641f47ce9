"""Options: the table of what can be given to the entities of a description, once for all that needs it.

A row is a field of the class that has the option. Name and type are the field's own, so that type checkers
and editors know them; `option()` has the default and the rest, and `required()` the rest of one without a
default:

    name: str = field(metadata=required("The name of the argument."))
    respawn_delay: float | Text = option(0.0, "Seconds before …", unit="s")

From the rows follow the attributes in docstrings, the checks of arguments, and for actions and event handlers
the keys of launch documents with their JSON schema, and the fields of process specifications.
"""

from __future__ import annotations

import inspect
import textwrap
from dataclasses import MISSING, Field, dataclass, field, fields, replace
from functools import cache
from typing import TYPE_CHECKING, Any, Final, TypeVar, cast

if TYPE_CHECKING:
    from collections.abc import Sequence

REQUIRED: Final = object()
"""The default of an option that must be given."""

T = TypeVar("T")

_KEY: Final = "option"
_WIDTH: Final = 110


@dataclass(frozen=True, kw_only=True)
class Option:
    """An option of an action, event handler, condition or substitution.

    Attributes:
        about: One sentence for users, also of launch documents.
        name: The parameter of the class.
        type: Its annotation.
        default: Its default value, or `REQUIRED`.
        keys: Its names in launch documents, the preferred one first; none if only Python can express it.
        unit: "s" for a duration in seconds, otherwise empty.
        least: The lowest value of a number.
        unlimited: Whether a duration may be infinite.
        choices: The values of a string; empty: any.
    """

    about: str
    name: str = ""
    type: str = ""
    default: object = REQUIRED
    keys: tuple[str, ...] = ()
    unit: str = ""
    least: float = 0.0
    unlimited: bool = False
    choices: tuple[str, ...] = ()

    @property
    def required(self) -> bool:
        """Whether it must be given."""
        return self.default is REQUIRED


def option(default: T, about: str, **facts: Any) -> T:
    """Return a dataclass field that is an option with a default.

    Args:
        default: Its default. Each object gets an empty mapping of its own.
        about: One sentence for users.
        facts: As for `required`.
    """
    # Typed as the default: type checkers know such fields only from calls of `dataclasses.field`.
    metadata = required(about, **facts)
    if default == {}:
        return cast("T", field(default_factory=dict[str, Any], metadata=metadata))
    return field(default=default, metadata=metadata)


def required(
    about: str, *, keys: str | None = None, choices: Sequence[str] = (), **facts: Any
) -> dict[str, Option]:
    """Return the metadata of a dataclass field that is an option without a default.

    Args:
        about: One sentence for users.
        keys: Its names in launch documents, separated by spaces; None: the name of the field; empty: none.
        choices: The values of a string.
        facts: Further attributes of the `Option`.
    """
    names = ("",) if keys is None else tuple(keys.split())
    return {_KEY: Option(about=about, keys=names, choices=tuple(choices), **facts)}


def options_of(cls: type[Any]) -> tuple[Option, ...]:
    """Return the options of an action or event handler, including those of its base classes.

    Args:
        cls: The class.
    """
    return _options_of(cls)  # type: ignore[arg-type]  # mypy takes no class for hashable


@cache
def _options_of(cls: type[Any]) -> tuple[Option, ...]:
    return tuple(_row(each, str(each.type)) for each in fields(cls) if _KEY in each.metadata)


def document_options(cls: type) -> None:
    """Add the options of a class, which may not be a dataclass yet, to its docstring."""
    found: dict[str, Field[Any]] = dict(getattr(cls, "__dataclass_fields__", {}))
    found |= {name: value for name, value in vars(cls).items() if isinstance(value, Field)}
    rows = {name: each.metadata[_KEY] for name, each in found.items() if _KEY in each.metadata}
    if cls.__doc__ and rows and "__init__" not in vars(cls):
        texts = [f"{name}: {row.about}" for name, row in rows.items()]
        wrapped = (
            textwrap.fill(each, _WIDTH, initial_indent=" " * 4, subsequent_indent=" " * 8) for each in texts
        )
        cls.__doc__ = "\n".join([inspect.cleandoc(cls.__doc__), "", "Attributes:", *wrapped])


def default_of(field: Field[Any]) -> object:
    """Return the default value of a dataclass field, or `REQUIRED`."""
    if field.default_factory is not MISSING:
        return field.default_factory()
    return REQUIRED if field.default is MISSING else field.default


def _row(field: Field[Any], annotation: str) -> Option:
    found = cast("Option", field.metadata[_KEY])
    keys = tuple(each or field.name for each in found.keys)
    return replace(found, name=field.name, type=annotation, default=default_of(field), keys=keys)
