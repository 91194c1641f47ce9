"""The daemon's configuration: from a TOML file, the command line and the defaults.

    configuration = load_configuration({"port": 0}, Path("broker.toml"))
    configuration.broker_options.port    # 0: the command line takes precedence over the file

The keys of the file are the fields of `BrokerOptions` and `DaemonOptions`. Types, ranges and help
come from there. A relative path in a file is relative to the file's folder.
"""

from __future__ import annotations

import json
from dataclasses import dataclass, fields
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, Final

from broker.errors import ConfigurationError
from broker.options import BrokerOptions, DaemonOptions
from proto.aio.toml_files import read_toml, unknown_option
from proto.untrusted_text import escape

if TYPE_CHECKING:
    from collections.abc import Mapping
    from dataclasses import Field

_SHOWN: Final = 60
"""Characters of a wrong value in an error."""

_KINDS: Final[Mapping[str, tuple[type, str]]] = {
    "bool": (bool, "true or false"),
    "int": (int, "an integer"),
    "float": (float, "a number"),
    "str": (str, "a string"),
    "Path": (Path, "a string with a path"),
}
"""The types of values by the annotation of the field, each with its description for errors."""

COMMAND_LINE: Final = "command line"
DEFAULT: Final = "default"


class Setting:
    """One option of the daemon.

    Attributes:
        name: The name of the field, and the key in the file.
        kind: The type of its values.
        default: Its default; None if there is no value unless one is given.
        help: Its meaning, with its unit.
        choices: The values that it can have; empty if the type and the range decide.
        reloads: Whether it can change while the broker runs.
    """

    def __init__(self, option: Field[Any]) -> None:
        annotation = str(option.type).removesuffix(" | None")
        self.kind, self._described = _KINDS[annotation]
        self.name = option.name
        self.default: object = option.default
        metadata = option.metadata
        self.help: str = metadata["help"]
        self.choices: tuple[str, ...] = metadata["choices"]
        self.reloads: bool = metadata["reloads"]
        self._least: float | None = metadata.get("least")
        self._most: float | None = metadata.get("most")

    @property
    def flag(self) -> str:
        """The option on the command line."""
        return "--" + self.name.replace("_", "-")

    @property
    def allowed(self) -> str:
        """The values that a file may have, such as "an integer from 0 to 65535"."""
        if self.choices:
            return f"one of {', '.join(map(_as_toml, self.choices))}"
        span = "" if self._least is None else f" from {self._least} to {self._most}"
        return self._described + span

    def read(self, value: object, folder: Path) -> object:
        """Check and convert the value that a file has for this option.

        Args:
            value: As tomllib returns it.
            folder: What a relative path is relative to.

        Raises:
            ConfigurationError: It is not allowed; the text names the allowed values.
        """
        wanted = str if self.kind is Path else self.kind
        given = float(value) if wanted is float and type(value) is int else value
        # Not isinstance: in Python `true` is an integer, too.
        fits = type(given) is wanted
        if isinstance(given, int | float) and self._least is not None and self._most is not None:
            fits = fits and self._least <= given <= self._most
        if not fits or (self.choices and given not in self.choices) or (self.kind is Path and not given):
            shown = escape(_as_toml(value))[:_SHOWN]
            raise ConfigurationError(f"{self.name} must be {self.allowed}, not {shown}")
        return folder / Path(str(given)).expanduser() if self.kind is Path else given


SETTINGS: Final[Mapping[str, Setting]] = MappingProxyType(
    {each.name: Setting(each) for each in (*fields(BrokerOptions), *fields(DaemonOptions))}
)
"""All options of the daemon by name, in the order of the help."""


@dataclass(frozen=True)
class Configuration:
    """The values of all options, and where each comes from.

    Attributes:
        broker_options: The options of the broker.
        daemon_options: The options of the daemon.
        sources: By option: COMMAND_LINE, DEFAULT or the path of the file.
    """

    broker_options: BrokerOptions
    daemon_options: DaemonOptions
    sources: Mapping[str, str]

    def values(self) -> dict[str, object]:
        """Return the value of each option by its name."""
        return {
            each.name: getattr(options, each.name)
            for options in (self.broker_options, self.daemon_options)
            for each in fields(options)
        }

    def to_toml(self) -> str:
        """Return a file with this configuration: each option with its help and the source of its value."""
        return "\n".join(self._entry(SETTINGS[name], value) for name, value in self.values().items())

    def _entry(self, setting: Setting, value: object) -> str:
        reload = "; SIGHUP applies a change" if setting.reloads else ""
        comment = f"# {setting.help} ({setting.allowed}{reload})\n"
        if value is None:
            return f"{comment}# {setting.name} is not set\n"
        return f"{comment}{setting.name} = {_as_toml(value)}  # {escape(self.sources[setting.name])}\n"


def load_configuration(given: Mapping[str, object], path: Path | None = None) -> Configuration:
    """Return the configuration: values of the command line first, then of the file, then the defaults.

    Args:
        given: Values from the command line by the names of their options.
        path: The file; None for none.

    Raises:
        ConfigurationError: The file cannot be read or is wrong.
        InvalidOptionError: A given value is out of range, or options contradict each other.
    """
    from_file = {} if path is None else _read(path)
    values = {**from_file, **given}
    sources = dict.fromkeys(SETTINGS, DEFAULT) | dict.fromkeys(from_file, str(path))
    broker_options = BrokerOptions(**_of(BrokerOptions, values))
    daemon_options = DaemonOptions(**_of(DaemonOptions, values))
    return Configuration(broker_options, daemon_options, sources | dict.fromkeys(given, COMMAND_LINE))


def _of(kind: type[BrokerOptions | DaemonOptions], values: Mapping[str, object]) -> dict[str, Any]:
    return {each.name: values[each.name] for each in fields(kind) if each.name in values}


def _read(path: Path) -> dict[str, object]:
    """Return the values in a file."""

    def read(table: dict[str, object]) -> dict[str, object]:
        return {key: _setting(key).read(value, path.parent) for key, value in table.items()}

    return read_toml(path, read, ConfigurationError)


def _setting(key: str) -> Setting:
    found = SETTINGS.get(key)
    if found is None:
        raise ConfigurationError(unknown_option(key, SETTINGS, "see callboard broker --help"))
    return found


def _as_toml(value: object) -> str:
    """Return a value as TOML."""
    if isinstance(value, str | Path):
        text = str(value).encode(errors="replace").decode()
        # DEL needs an escape in TOML, but not in JSON.
        return json.dumps(text, ensure_ascii=False).replace("\x7f", "\\u007f")
    return str(value).lower() if isinstance(value, bool | float) else str(value)
