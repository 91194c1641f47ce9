"""ROS 2's command-line arguments, which are between `--ros-args` and `--`."""

from __future__ import annotations

from contextvars import ContextVar
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Any, Final

from actors.arguments.remapping import RemapRule
from actors.logging.severity import LoggingSeverity, severity_from_name
from proto.errors import CallboardError
from proto.untrusted_text import escape

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

    from actors.parameters.overrides import ParameterOverride
    from actors.parameters.types import ParameterValue


class InvalidRosArgumentError(CallboardError, ValueError):
    """An argument after `--ros-args` is unknown, incomplete or wrong.

    Attributes:
        argument: The offending text.
    """

    is_operational = True

    def __init__(self, argument: str, reason: str) -> None:
        lines = [escape(line) for line in reason.splitlines()]
        super().__init__(
            "\n".join([f"Failed to parse ROS arguments: '{escape(argument)}': {lines[0]}", *lines[1:]])
        )
        self.argument = argument


class UnknownRosArgumentError(InvalidRosArgumentError):
    """Arguments after `--ros-args` are none of ROS's."""


@dataclass(frozen=True, kw_only=True)
class RosArguments:
    """ROS arguments for the nodes of a process.

    Attributes:
        remap_rules: In the order given; the first that matches is applied.
        parameter_overrides: From `-p` and from files, in the order given; the last that matches wins.
        log_level: For all loggers.
        logger_levels: For single loggers, in the order given.
        log_config_file: Accepted and ignored.
        log_file_name: Accepted and ignored.
        enclave: Accepted and ignored.
        rosout_logs: Whether nodes publish their log on `/rosout`.
        stdout_logs: Whether the script's log lines go to the terminal.
        external_lib_logs: Accepted and ignored: there is no external logging library.
        remaining: All arguments that are not ROS's, in order.
    """

    remap_rules: tuple[RemapRule, ...] = ()
    parameter_overrides: tuple[ParameterOverride, ...] = ()
    log_level: LoggingSeverity | None = None
    logger_levels: tuple[tuple[str, LoggingSeverity], ...] = ()
    log_config_file: str | None = None
    log_file_name: str | None = None
    enclave: str | None = None
    rosout_logs: bool = True
    stdout_logs: bool = True
    external_lib_logs: bool = True
    remaining: tuple[str, ...] = ()

    def parameters_for(self, full_node_name: str) -> dict[str, ParameterValue]:
        """Return the parameter values for one node.

        Args:
            full_node_name: Such as "/ns/talker".
        """
        if not self.parameter_overrides:
            return {}
        from actors.parameters.overrides import overrides_for  # noqa: PLC0415 - only with parameters

        return overrides_for(self.parameter_overrides, full_node_name)


process_arguments: Final[ContextVar[RosArguments | None]] = ContextVar(
    "callboard_process_arguments", default=None
)
"""The arguments that `actors.run` has parsed; nodes use them unless `use_global_arguments=False`."""


_TEXTS: Final = {
    "--log-config-file": "log_config_file",
    "--log-file-name": "log_file_name",
    "--enclave": "enclave",
}
_SWITCHES: Final = {
    f"--{verb}-{name}-logs": (f"{name.replace('-', '_')}_logs", verb == "enable")
    for verb in ("enable", "disable")
    for name in ("rosout", "stdout", "external-lib")
}


class _Builder:
    """Collects arguments; `values` has the fields of RosArguments that have one value."""

    def __init__(self) -> None:
        self.rules: list[RemapRule] = []
        self.overrides: list[ParameterOverride] = []
        self.logger_levels: list[tuple[str, LoggingSeverity]] = []
        self.values: dict[str, Any] = {}
        self.remaining: list[str] = []
        self.unknown: list[str] = []
        self.handlers: dict[str, Callable[[str], None]] = {
            "--remap": self.remap,
            "--param": self.param,
            "--params-file": self.params_file,
            "--log-level": self.log_level,
            **{flag: partial(self.values.__setitem__, field) for flag, field in _TEXTS.items()},
        }

    def build(self) -> RosArguments:
        return RosArguments(
            remap_rules=tuple(self.rules),
            parameter_overrides=tuple(self.overrides),
            logger_levels=tuple(self.logger_levels),
            remaining=tuple(self.remaining),
            **self.values,
        )

    def remap(self, text: str) -> None:
        self.rules.append(RemapRule.parse(text))

    def param(self, text: str) -> None:
        from actors.parameters.overrides import ParameterOverride  # noqa: PLC0415 - only with parameters

        self.overrides.append(ParameterOverride.parse(text))

    def params_file(self, path: str) -> None:
        from actors.parameters.overrides import load_parameter_file  # noqa: PLC0415 - only with files

        self.overrides.extend(load_parameter_file(path))

    def log_level(self, text: str) -> None:
        name, separator, word = text.rpartition(":=")
        if not separator:
            self.values["log_level"] = severity_from_name(word)
        elif name:
            self.logger_levels.append((name, severity_from_name(word)))
        else:
            raise ValueError("expected level or logger:=level, such as DEBUG or talker:=DEBUG")


_ALIASES: Final = {"-r": "--remap", "-p": "--param", "-e": "--enclave"}
_EXPECTED: Final = {
    "--remap": "from:=to",
    "--param": "name:=value",
    "--params-file": "a YAML file",
    "--log-level": "a level, such as DEBUG",
    "--log-config-file": "a file name",
    "--log-file-name": "a file name",
    "--enclave": "an enclave name",
}


def parse_ros_arguments(argv: Sequence[str]) -> RosArguments:
    """Return the ROS arguments of a command line.

    ROS arguments are between `--ros-args` and the next `--` (or the end); there may be several such sections.
    The rest, with further `--`, is kept for the program.

    Args:
        argv: The command line, with or without the program's name.

    Raises:
        UnknownRosArgumentError: ROS 2 has no such argument.
        InvalidRosArgumentError: A ROS argument lacks its value or has a wrong one, or a parameter file cannot
            be used.
    """
    builder = _Builder()
    arguments = iter(argv)
    for argument in arguments:
        if argument == "--ros-args":
            _parse_section(arguments, builder)
        else:
            builder.remaining.append(argument)
    if builder.unknown:
        hint = "a remap rule needs -r before it, a parameter -p"
        raise UnknownRosArgumentError(
            " ".join(builder.unknown), f"Found unknown ROS arguments {builder.unknown}; {hint}"
        )
    return builder.build()


def _parse_section(arguments: Iterator[str], builder: _Builder) -> None:
    for argument in arguments:
        if argument == "--":
            return
        flag = _ALIASES.get(argument, argument)
        if flag in builder.handlers:
            _apply(argument, builder.handlers[flag], next(arguments, None), _EXPECTED[flag])
        elif flag in _SWITCHES:
            builder.values.update([_SWITCHES[flag]])
        elif flag != "--ros-args":
            builder.unknown.append(argument)


def _apply(argument: str, handler: Callable[[str], None], value: str | None, expected: str) -> None:
    if value is None:
        raise InvalidRosArgumentError(argument, f"a value is missing, expected {expected}")
    try:
        handler(value)
    except ValueError as error:
        raise InvalidRosArgumentError(f"{argument} {value}", str(error)) from error
