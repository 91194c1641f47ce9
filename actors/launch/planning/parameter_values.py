"""Values of parameters in launch files, as ROS 2's launch gives them to a node."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import PurePath
from typing import TYPE_CHECKING, Any, Final, cast, get_args, get_origin

from actors.interfaces.yaml_reader import PlainText, YamlError, load_yaml
from actors.interfaces.yaml_scalars import launch_scalar, yaml_scalar
from actors.launch.description.conditions import to_bool
from actors.launch.description.process_actions import ParameterValue
from actors.launch.description.substitutions import Substitution, resolve
from actors.launch.errors import LaunchError
from proto.untrusted_text import escape

if TYPE_CHECKING:
    from actors.launch.description.substitutions import LaunchContext, Text

_SCALARS: Final = (str, int, float, bool)
_SHOWN_CHARS: Final = 80


def parameter_value(value: Any, context: LaunchContext) -> Any:
    """Return a value without substitutions: a scalar, bytes, or a list of scalars of one type.

    The text of a substitution is read as YAML. A list of integers and doubles is one of doubles.

    Args:
        value: What a description has.
        context: For the substitutions.

    Raises:
        LaunchError: A parameter cannot have this value, or a substitution has no value.
    """
    match value:
        case bool() | int() | float() | str() | bytes():
            return value
        case PurePath():
            return str(value)
        case Substitution():
            return value_from_text(resolve(value, context))
        case ParameterValue():
            return _typed(value, context)
        case Sequence():
            return _list(cast("Any", value), context)
        case _:
            raise LaunchError(f"cannot be {value!r}")


def value_from_text(text: str) -> Any:
    """Return the parameter value of a string in a launch file: the string itself if it is not YAML.

    Raises:
        LaunchError: It is a mapping, or a list that no parameter can have.
    """
    if not text:
        return text
    try:
        value = load_yaml(text, rules=_scalar)
    except YamlError:
        return text
    if isinstance(value, list):
        return _of_one_type(cast("Any", value))
    if isinstance(value, _SCALARS):
        return value
    what = "a mapping" if isinstance(value, dict) else "nothing"
    shown = escape(text[:_SHOWN_CHARS])
    raise LaunchError(f"'{shown}' is {what} in YAML, no value of a parameter; a string needs the type str")


def _scalar(text: str) -> object:
    return launch_scalar(text) if text else None  # `-` is a list of nothing


def _list(values: Sequence[Any], context: LaunchContext) -> Any:
    if any(isinstance(each, Substitution) for each in values) and all(
        isinstance(each, Substitution | str) for each in values
    ):  # pieces of one string
        return value_from_text(resolve(cast("Text", values), context))
    items = [
        # In a list, the pieces of one string are in a list of their own.
        value_from_text(resolve(cast("Text", each), context))
        if isinstance(each, list | tuple)
        else parameter_value(each, context)
        for each in values
    ]
    if {type(each) for each in values} == {int, float}:
        return [float(each) for each in values]
    return _of_one_type(items)


def _of_one_type(items: list[Any]) -> list[Any]:
    kinds: set[type[object]] = {type(each) for each in items}
    if len(kinds) > 1 or not kinds.issubset(_SCALARS):
        raise LaunchError(
            f"the values of a list must be of one type, not {escape(str(items)[:_SHOWN_CHARS])}"
        )
    return items


def _typed(parameter: ParameterValue, context: LaunchContext) -> Any:
    kind, value = parameter.value_type, parameter.value
    if kind is None:
        return parameter_value(value, context)
    if get_origin(kind) is list:
        return [_converted(each, get_args(kind)[0], context) for each in _items(value, context)]
    return _converted(value, kind, context)


def _items(value: Any, context: LaunchContext) -> Sequence[Any]:
    """Return the elements of a YAML list as they are written in the text."""
    if not isinstance(value, str | Substitution):
        return cast("Sequence[Any]", value)
    text = resolve(value, context)
    try:
        items: Any = load_yaml(text, rules=PlainText)
    except YamlError as error:
        raise LaunchError(f"'{escape(text[:_SHOWN_CHARS])}' is no list in YAML: {error}") from None
    if not isinstance(items, list):
        raise LaunchError(f"'{escape(text[:_SHOWN_CHARS])}' is no list in YAML")
    return [*cast("Any", items)]


def _converted(value: Any, kind: Any, context: LaunchContext) -> Any:
    if kind not in _SCALARS:
        raise LaunchError(f"value_type can be str, int, float or bool, or a list of one, not {kind!r}")
    if isinstance(value, PlainText) and kind in {int, float}:
        # Python itself reads neither `0x10` nor `.inf`, and `010` as ten.
        number = yaml_scalar(value)
        value = value if isinstance(number, bool | str) else number
    text = str(value) if isinstance(value, int | float) else resolve(cast("Text", value), context)
    try:
        return to_bool(text, context) if kind is bool else kind(text)
    except ValueError:
        raise LaunchError(f"expected a value of type {kind.__name__}, not '{escape(text)}'") from None
