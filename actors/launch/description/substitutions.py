"""Substitutions: strings that depend on arguments, variables, files or events.

    [LaunchConfiguration("robot"), "_camera"]       a list is one string in pieces
    PathJoinSubstitution([ThisLaunchFileDir(), "parameters.yaml"])

They are data; `resolve` evaluates them in a `LaunchContext`.
"""

from __future__ import annotations

import shlex
from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from pathlib import PurePath
from typing import TYPE_CHECKING, Any, ClassVar, Final, TypeAlias, cast

from actors.launch.description.options import option, required
from actors.launch.description.validation import MAX_DEPTH, MAX_SHOWN, Entity, excerpt
from actors.launch.errors import LaunchError
from proto.untrusted_text import escape

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from actors.launch.description.library import Library


MAX_TEXT: Final = 2 << 20
"""Characters of a string after its substitutions: twice what a command may write. A few lines of a launch
file whose values double each time would otherwise fill all memory."""

MAX_TEXTS: Final = 256 << 20
"""Characters of all strings together, in what a launch does at its beginning, or at one event."""

MAX_COMMAND: Final = 128 << 10
"""The most characters of a string that is split into words. No system starts a program with a longer
argument, and splitting takes time that grows with the square of a word's length."""


class TextCount:
    """Counts the characters of the strings of one launch, or of one event."""

    def __init__(self) -> None:
        self._characters = 0

    def add(self, characters: int) -> None:
        """Count a string.

        Raises:
            LaunchError: They are too many.
        """
        self._characters += characters
        if self._characters > MAX_TEXTS:
            raise LaunchError(f"The texts of this launch have more than {MAX_TEXTS} characters together")


@dataclass(kw_only=True)
class LaunchContext:
    """The arguments, variables and settings that apply to an action. Functions of a description get it, too.

    Groups and included files have a context of their own, made of that around them.

    Attributes:
        library: Finds files, packages and programs.
        launch_configurations: The arguments and their values.
        environment: The environment of programs.
        namespace: The namespace that has been pushed, or None.
        folder: The folder of the launch file.
        file: The launch file; None: the description comes from no file.
        parameters: Parameters of all nodes: values as YAML, by name.
        remappings: Remappings of all nodes: pairs of a name and the one to use instead.
        parameter_files: Parameter files of all nodes.
        saved_configurations: Stack of `PushLaunchConfigurations`.
        saved_environments: Stack of `PushEnvironment`.
        first_environment: The environment at the beginning of the launch.
        event: The event that is being handled, if any.
        used: Arguments that have been looked up. All contexts of a launch share it.
        anonymous: Names that `AnonName` has chosen. All contexts of a launch share it.
        texts: Counts what is resolved. All contexts share it, except that each event has its own.
    """

    library: Library
    launch_configurations: dict[str, str] = field(default_factory=dict[str, str])
    environment: dict[str, str] = field(default_factory=dict[str, str])
    namespace: str | None = None
    folder: str = ""
    file: str | None = None
    parameters: dict[str, str] = field(default_factory=dict[str, str])
    remappings: list[tuple[str, str]] = field(default_factory=list[tuple[str, str]])
    parameter_files: list[str] = field(default_factory=list[str])
    saved_configurations: list[LaunchContext] = field(default_factory=list["LaunchContext"])
    saved_environments: list[dict[str, str]] = field(default_factory=list[dict[str, str]])
    first_environment: Mapping[str, str] = field(default_factory=dict[str, str])
    event: object = None
    used: set[str] = field(default_factory=set[str])
    anonymous: dict[str, str] = field(default_factory=dict[str, str])
    texts: TextCount = field(default_factory=TextCount)

    def inner(self) -> LaunchContext:
        """Return a copy, whose changes do not affect this context."""
        return replace(
            self,
            launch_configurations=dict(self.launch_configurations),
            environment=dict(self.environment),
            parameters=dict(self.parameters),
            remappings=list(self.remappings),
            parameter_files=list(self.parameter_files),
            saved_configurations=[],
            saved_environments=[],
        )

    def initial(self) -> LaunchContext:
        """Return a context in which nothing has been set, pushed or declared since the launch began."""
        return replace(
            self.inner(),
            launch_configurations={},
            environment=dict(self.first_environment),
            namespace=None,
            parameters={},
            remappings=[],
            parameter_files=[],
        )

    def adopt(self, inner: LaunchContext) -> None:
        """Take over the settings of an inner context.

        Args:
            inner: That context. It must not be used after this.
        """
        self.environment = inner.environment
        self.restore(inner)

    def restore(self, saved: LaunchContext) -> None:
        """Take over all settings but the environment: what launch and launch_ros have as configurations.

        Args:
            saved: Their context. It must not be used after this.
        """
        self.launch_configurations, self.namespace = saved.launch_configurations, saved.namespace
        self.parameters, self.parameter_files = saved.parameters, saved.parameter_files
        self.remappings = saved.remappings

    def perform_substitution(self, text: Text) -> str:
        """Evaluate a substitution.

        Args:
            text: A string, a substitution, or a list of them.

        Returns:
            Its value.

        Raises:
            LaunchError: It has no value here, or is of another type.
        """
        return resolve(text, self)


class Substitution(Entity, ABC):
    """A string that depends on the context."""

    kind: ClassVar[str] = "substitution"

    @abstractmethod
    def perform(self, context: LaunchContext) -> str:
        """Return its value.

        Args:
            context: Where it is evaluated.

        Raises:
            LaunchError: It has no value there.
        """


Text: TypeAlias = "str | PurePath | Substitution | Sequence[Text]"
"""A string, or something that is resolved to one; a list is joined without separators."""


@dataclass(frozen=True)
class TextSubstitution(Substitution):
    """A constant string."""

    text: str = field(metadata=required("The string."))

    def perform(self, context: LaunchContext) -> str:
        del context
        return self.text


@dataclass(frozen=True)
class LaunchConfiguration(Substitution):
    """The value of an argument."""

    variable_name: Text = field(metadata=required("The argument."))
    default: Text | None = option(
        None, "Its value if it is neither declared nor given; None: that is an error."
    )

    def perform(self, context: LaunchContext) -> str:
        name = resolve(self.variable_name, context)
        context.used.add(name)
        value = context.launch_configurations.get(name)
        if value is not None:
            return value
        if self.default is None:
            raise LaunchError(f"Launch argument '{name}' is used, but not declared before that")
        return resolve(self.default, context)


@dataclass(frozen=True)
class EnvironmentVariable(Substitution):
    """The value of an environment variable, as the programs here get it."""

    name: Text = field(metadata=required("The variable."))
    default_value: Text | None = option(None, "Its value if it is not set; None: that is an error.")

    def perform(self, context: LaunchContext) -> str:
        name = resolve(self.name, context)
        value = context.environment.get(name)
        if value is not None:
            return value
        if self.default_value is None:
            raise LaunchError(f"Environment variable '{name}' is not set")
        return resolve(self.default_value, context)


class NoEventError(LaunchError):
    """A substitution depends on an event, but is not evaluated in an event handler."""


@dataclass(frozen=True)
class LocalSubstitution(Substitution):
    """An attribute of the event that is being handled, such as `LocalSubstitution("event.reason")`."""

    expression: str = field(metadata=required('"event", and names of attributes after dots.'))
    description: str = option("", "A human-readable description, not used.")

    def perform(self, context: LaunchContext) -> str:
        """Return its value.

        Args:
            context: Where it is evaluated.

        Raises:
            NoEventError: No event is being handled.
            LaunchError: The event has no such attribute.
        """
        first, *names = self.expression.split(".")
        if first != "event" or not all(each.isidentifier() and each[0] != "_" for each in names):
            raise LaunchError(f"LocalSubstitution has 'event.NAME', not '{escape(self.expression)}'")
        if context.event is None:
            raise NoEventError(f"'{self.expression}' is known in event handlers only")
        value = context.event
        for each in names:
            if not hasattr(value, each):
                raise LaunchError(f"LocalSubstitution: {type(value).__name__} has no '{each}'")
            value = getattr(value, each)
        return str(value)


@dataclass(frozen=True)
class PathJoinSubstitution(Substitution):
    """A path made of parts."""

    substitutions: Sequence[Text] = field(metadata=required("The parts."))

    def perform(self, context: LaunchContext) -> str:
        return str(PurePath(*(resolve(part, context) for part in self.substitutions)))


@dataclass(frozen=True)
class ThisLaunchFileDir(Substitution):
    """The folder of the launch file with this substitution in it."""

    def perform(self, context: LaunchContext) -> str:
        return context.folder


@dataclass(frozen=True)
class ThisLaunchFile(Substitution):
    """The path of the launch file with this substitution in it."""

    def perform(self, context: LaunchContext) -> str:
        if context.file is None:
            raise LaunchError("ThisLaunchFile: this description comes from no file")
        return context.file


def resolve(text: Text, context: LaunchContext) -> str:
    """Evaluate a string, a substitution, or a list of them in a context.

    Raises:
        LaunchError: It has no value there, is of another type, or becomes too long.
    """
    pieces: list[str] = []
    size = 0
    for piece in _pieces(text, context, 0):
        pieces.append(piece)
        size += len(piece)
        if size > MAX_TEXT:
            start = excerpt("".join(pieces)[:MAX_SHOWN])
            raise LaunchError(f"A string becomes longer than {MAX_TEXT} characters; it begins with {start}")
    context.texts.add(size)
    return "".join(pieces)


def split_command(text: str) -> list[str]:
    """Split a command into words, as a shell does.

    Raises:
        ValueError: A quote is not closed, or the command is too long.
    """
    if len(text) > MAX_COMMAND:
        raise ValueError(f"it has more than {MAX_COMMAND} characters")
    return shlex.split(text)


def _pieces(text: Text, context: LaunchContext, depth: int) -> Iterator[str]:
    # Launch files are seldom checked for types.
    value: Any = text
    if isinstance(value, str | PurePath):
        yield str(value)
    elif isinstance(value, Substitution):
        yield value.perform(context)
    elif isinstance(value, Sequence) and depth < MAX_DEPTH:
        for piece in cast("Sequence[Text]", value):
            yield from _pieces(piece, context, depth + 1)
    else:
        raise LaunchError(f"Expected a string or a substitution, not {excerpt(cast('object', value))}")
