"""Substitutions: texts that are known only when the launch file is carried out.

    [LaunchConfiguration("robot"), "_camera"]       a list is one text, piece by piece
    PathJoinSubstitution([ThisLaunchFileDir(), "parameters.yaml"])

They are data; `resolve` gives the text, from a `Scope` and nothing else.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from pathlib import PurePath
from typing import TYPE_CHECKING, Any, ClassVar, TypeAlias, cast

from actors.launch.description.validation import MAX_DEPTH, Part, excerpt
from actors.launch.errors import LaunchError
from proto.errors import escape

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from actors.launch.description.library import Library


@dataclass(kw_only=True)
class Scope:
    """What is set at a place in a description.

    Attributes:
        library: What there is outside of the description.
        configurations: The arguments and their values.
        environment: What programs get that are started here.
        namespace: Pushed by those around; None while nobody has pushed one.
        folder: Of the launch file.
        file: The launch file; None: the description comes from none.
        parameters: What has been set for all nodes here: values as YAML, by name.
        remappings: What has been set for all nodes here: pairs of a name and the one to use instead.
        parameter_files: Files of parameters for all nodes here.
        saved_configurations: What `PushLaunchConfigurations` has saved, the last one last.
        saved_environments: What `PushEnvironment` has saved.
        first_environment: The environment at the beginning of the launch.
        event: The event that is being reacted to, if any.
        used: All names that have been looked up, in this scope and those around and within it.
        anonymous: The names that `AnonName` has given, the same in all scopes of a launch.
    """

    library: Library
    configurations: dict[str, str] = field(default_factory=dict[str, str])
    environment: dict[str, str] = field(default_factory=dict[str, str])
    namespace: str | None = None
    folder: str = ""
    file: str | None = None
    parameters: dict[str, str] = field(default_factory=dict[str, str])
    remappings: list[tuple[str, str]] = field(default_factory=list[tuple[str, str]])
    parameter_files: list[str] = field(default_factory=list[str])
    saved_configurations: list[dict[str, str]] = field(default_factory=list[dict[str, str]])
    saved_environments: list[dict[str, str]] = field(default_factory=list[dict[str, str]])
    first_environment: Mapping[str, str] = field(default_factory=dict[str, str])
    event: object = None
    used: set[str] = field(default_factory=set[str])
    anonymous: dict[str, str] = field(default_factory=dict[str, str])

    def inner(self) -> Scope:
        """Return a scope within it: it begins as this one is now, and what it sets stays in it."""
        return replace(
            self,
            configurations=dict(self.configurations),
            environment=dict(self.environment),
            parameters=dict(self.parameters),
            remappings=list(self.remappings),
            parameter_files=list(self.parameter_files),
            saved_configurations=[],
            saved_environments=[],
        )

    def take(self, inner: Scope) -> None:
        """Set here what is set in a scope within it.

        Args:
            inner: That scope. It is not used after this.
        """
        self.configurations, self.environment = inner.configurations, inner.environment
        self.parameters, self.parameter_files = inner.parameters, inner.parameter_files
        self.remappings, self.namespace = inner.remappings, inner.namespace

    @property
    def launch_configurations(self) -> dict[str, str]:
        """The arguments and their values, by ROS 2's name for them."""
        return self.configurations

    def perform_substitution(self, text: Text) -> str:
        """Return the text that a substitution has here.

        Args:
            text: A text, a substitution, or a list of them.

        Raises:
            LaunchError: It has no value here, or is no text.
        """
        return resolve(text, self)


LaunchContext = Scope
"""What functions of a description are called with."""


class Substitution(Part, ABC):
    """A text that depends on the scope."""

    noun: ClassVar[str] = "substitution"

    @abstractmethod
    def perform(self, scope: Scope) -> str:
        """Return the text.

        Args:
            scope: What is set at the place of the description where it is used.

        Raises:
            LaunchError: It has no value there.
        """


Text: TypeAlias = "str | PurePath | Substitution | Sequence[Text]"
"""A text, or what becomes one: a list is its pieces, one behind the other."""


@dataclass(frozen=True)
class TextSubstitution(Substitution):
    """A text as it is.

    Attributes:
        text: The text.
    """

    text: str

    def perform(self, scope: Scope) -> str:
        del scope
        return self.text


@dataclass(frozen=True)
class LaunchConfiguration(Substitution):
    """The value of an argument.

    Attributes:
        variable_name: The argument.
        default: Its value if nobody has declared or given it; None: that is an error.
    """

    variable_name: Text
    default: Text | None = None

    def perform(self, scope: Scope) -> str:
        name = resolve(self.variable_name, scope)
        scope.used.add(name)
        value = scope.configurations.get(name)
        if value is not None:
            return value
        if self.default is None:
            raise LaunchError(f"Launch argument '{name}' is used, but not declared before that")
        return resolve(self.default, scope)


@dataclass(frozen=True)
class EnvironmentVariable(Substitution):
    """The value of an environment variable, as the programs here get it.

    Attributes:
        name: The variable.
        default_value: Its value if it is not set; None: that is an error.
    """

    name: Text
    default_value: Text | None = None

    def perform(self, scope: Scope) -> str:
        name = resolve(self.name, scope)
        value = scope.environment.get(name)
        if value is not None:
            return value
        if self.default_value is None:
            raise LaunchError(f"Environment variable '{name}' is not set")
        return resolve(self.default_value, scope)


class NoEventError(LaunchError):
    """A text depends on an event, and none has happened yet."""


@dataclass(frozen=True)
class LocalSubstitution(Substitution):
    """A fact about the event that is being reacted to, such as `LocalSubstitution("event.reason")`.

    Attributes:
        expression: "event", and the names of attributes behind dots.
        description: A text for people.
    """

    expression: str
    description: str = ""

    def perform(self, scope: Scope) -> str:
        """Return the text.

        Args:
            scope: What is set at the place of the description where it is used.

        Raises:
            NoEventError: No event is being reacted to.
            LaunchError: It has no such attribute.
        """
        first, *names = self.expression.split(".")
        if first != "event" or not all(each.isidentifier() and each[0] != "_" for each in names):
            raise LaunchError(f"LocalSubstitution has 'event.NAME', not '{escape(self.expression)}'")
        if scope.event is None:
            raise NoEventError(f"'{self.expression}' is known in event handlers only")
        value = scope.event
        for each in names:
            if not hasattr(value, each):
                raise LaunchError(f"LocalSubstitution: {type(value).__name__} has no '{each}'")
            value = getattr(value, each)
        return str(value)


@dataclass(frozen=True)
class PathJoinSubstitution(Substitution):
    """A path made of parts.

    Attributes:
        substitutions: The parts.
    """

    substitutions: Sequence[Text]

    def perform(self, scope: Scope) -> str:
        return str(PurePath(*(resolve(part, scope) for part in self.substitutions)))


@dataclass(frozen=True)
class ThisLaunchFileDir(Substitution):
    """The folder of the launch file with this substitution in it."""

    def perform(self, scope: Scope) -> str:
        return scope.folder


@dataclass(frozen=True)
class ThisLaunchFile(Substitution):
    """The path of the launch file with this substitution in it."""

    def perform(self, scope: Scope) -> str:
        if scope.file is None:
            raise LaunchError("ThisLaunchFile: this description comes from no file")
        return scope.file


def resolve(text: Text, scope: Scope) -> str:
    """Return the text that a substitution has in a scope.

    Raises:
        LaunchError: It has no value there, or is no text.
    """
    return "".join(_pieces(text, scope, 0))


def _pieces(text: Text, scope: Scope, depth: int) -> Iterator[str]:
    # Launch files are seldom checked for types.
    value: Any = text
    if isinstance(value, str | PurePath):
        yield str(value)
    elif isinstance(value, Substitution):
        yield value.perform(scope)
    elif isinstance(value, Sequence) and depth < MAX_DEPTH:
        for piece in cast("Sequence[Text]", value):
            yield from _pieces(piece, scope, depth + 1)
    else:
        raise LaunchError(f"A text is wanted, or a substitution, not {excerpt(cast('object', value))}")
