r"""Strings with substitutions in them, as ROS 2's launch files write them.

    $(var robot)_camera            the argument robot, followed by "_camera"
    $(env HOME '/tmp')             spaces separate arguments; quotes keep one together
    $(var $(env ROBOT)_name)       substitutions within substitutions
    $(eval '$(var n) > 1')         also within quotes
    \$(var robot)                  a backslash escapes the character after it

A `$` without a parenthesis, and quotes outside of a substitution, have no special meaning.
"""

from __future__ import annotations

import re
from dataclasses import KW_ONLY, dataclass, field
from pathlib import PurePath
from typing import TYPE_CHECKING, Final, TypeAlias

from actors.launch.description import library_substitutions, logic
from actors.launch.description.conditions import to_bool
from actors.launch.description.options import option, required
from actors.launch.description.python_expression import PythonExpression
from actors.launch.description.substitutions import (
    EnvironmentVariable,
    LaunchConfiguration,
    PathJoinSubstitution,
    Substitution,
    ThisLaunchFile,
    ThisLaunchFileDir,
    resolve,
    split_command,
)
from actors.launch.errors import LaunchError
from actors.tools.suggestions import did_you_mean
from proto.untrusted_text import escape

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from actors.launch.description.substitutions import LaunchContext, Text

MAX_DEPTH: Final = 20
"""Depth of nested substitutions."""
MAX_ARGUMENTS: Final = 100
"""Arguments of one substitution."""

Piece: TypeAlias = str | Substitution

_NAME: Final = re.compile(r"[A-Za-z][A-Za-z0-9_-]*")
_SPACES: Final = " \t\r\n"
_ENDS: Final = _SPACES + ")"
"""What ends an argument without quotes."""
_PLAIN: Final = re.compile(r"""[^\\$'"() \t\r\n]+""")
"""Characters that mean nothing else in any place."""
_MARK: Final = "\0"
"""Marks the number of a substitution while a string is split into words."""


def template(text: str) -> Text:
    """Return a string without substitutions as it is, and otherwise a substitution or a list of pieces.

    Raises:
        LaunchError: A substitution in it is malformed or unknown.
    """
    return _joined(_Reader(text).pieces())


def words(text: str) -> tuple[Text, ...]:
    """Split a string into words, as a shell does. The values of substitutions are not split.

    Raises:
        LaunchError: A substitution in it is malformed or unknown, or a quote is not closed.
    """
    # Substitutions are marked while the text is split, so that spaces in their arguments split nothing.
    pieces = _Reader(text).pieces()
    marked = (each if isinstance(each, str) else f"{_MARK}{at}{_MARK}" for at, each in enumerate(pieces))
    try:
        split = split_command("".join(marked))
    except ValueError as error:
        raise LaunchError(f"'{escape(text)}' cannot be split into words: {error}") from None
    return tuple(_joined(_unmarked(word, pieces)) for word in split)


def known_substitutions() -> list[str]:
    """Return the names of all substitutions, for `$(`."""
    return sorted(_CALLS)


def _unmarked(word: str, pieces: Sequence[Piece]) -> list[Piece]:
    parts: list[Piece] = list(word.split(_MARK))
    parts[1::2] = [pieces[int(str(number))] for number in parts[1::2]]
    return [each for each in parts if each != ""]


def _joined(pieces: Sequence[Piece]) -> Text:
    if not pieces:
        return ""
    return pieces[0] if len(pieces) == 1 else tuple(pieces)


class _Reader:
    """A string that is being parsed, and the position in it."""

    def __init__(self, text: str) -> None:
        if _MARK in text:  # `words` needs it, and no program could get it as an argument
            raise LaunchError("A text cannot have a null character in it")
        self._text = text
        self._at = 0
        self._depth = 0

    def pieces(self, end: str = "") -> list[Piece]:
        """Read up to one of these characters, or to the end.

        Args:
            end: A quote, or what ends an argument without quotes; empty: the string itself.
        """
        pieces: list[Piece] = []
        literal: list[str] = []  # joined at its end: adding to a string copies it
        while (char := self._char()) and char not in end:
            if plain := _PLAIN.match(self._text, self._at):
                literal.append(plain[0])
                self._at = plain.end()
                continue
            if self._text.startswith("$(", self._at):
                pieces += ["".join(literal), self._substitution()]
                literal.clear()
                continue
            # A backslash at the end is one: there is nothing to escape.
            if char == "\\" and self._at + 1 < len(self._text):
                self._at += 1
            # In the middle of an argument they are nearly always a slip, such as a missing space.
            elif end == _ENDS and char in "'\"(":
                raise self._error(f"{char} needs a backslash before it, or quotes around the whole argument")
            literal.append(self._char())
            self._at += 1
        # Without the empty strings between adjacent substitutions, one alone is not a list.
        return [each for each in (*pieces, "".join(literal)) if each != ""]

    def _substitution(self) -> Substitution:
        begin = self._at
        self._depth += 1
        # The reader and the evaluation are recursive.
        if self._depth > MAX_DEPTH:
            raise LaunchError(f"Substitutions are nested deeper than {MAX_DEPTH}")
        # An error and not text: a misspelled substitution would reach the program as it is.
        named = _NAME.match(self._text, begin + 2)
        if named is None:
            raise self._error(r"$( needs the name of a substitution; write \$( for the text itself")
        self._at = named.end()
        arguments = self._arguments(begin)
        self._depth -= 1
        call = _CALLS.get(named[0])
        if call is None:
            hint = did_you_mean(named[0], _CALLS) or f"; there is {', '.join(known_substitutions())}"
            raise LaunchError(f"No substitution '{escape(named[0])}'{hint}")
        if not call.least <= len(arguments) <= call.most:
            raise LaunchError(
                f"'{escape(self._text[begin : self._at])}' should be {call.form}"
                "; an argument with spaces in it needs quotes"
            )
        return call.make(*arguments)

    def _arguments(self, begin: int) -> list[Text]:
        """Read up to the closing parenthesis, and past it."""
        found: list[Text] = []
        while True:
            spaced = self._char() in _SPACES
            while (char := self._char()) and char in _SPACES:
                self._at += 1
            if not char:
                self._at = begin  # the error shows where it was opened
                raise self._error("$( is not closed")
            if char == ")":
                self._at += 1
                return found
            if not spaced:
                raise self._error("a space or ) is missing")
            found.append(self._argument())

    def _argument(self) -> Text:
        quote = self._char()
        # In quotes spaces belong to the argument, and substitutions are evaluated all the same.
        if quote not in "'\"":
            return _joined(self.pieces(_ENDS))
        begin = self._at
        self._at += 1
        pieces = self.pieces(quote)
        if not self._char():
            self._at = begin
            raise self._error(f"{quote} is not closed")
        self._at += 1
        return _joined(pieces)

    def _char(self) -> str:
        """Return the next character; nothing at the end."""
        return self._text[self._at : self._at + 1]

    def _error(self, what: str) -> LaunchError:
        rest = self._text[self._at :]
        return LaunchError(f"{what}, at '{escape(rest)}'")


@dataclass(frozen=True)
class ParameterFile(Substitution):
    """The path of a YAML file of parameters, in which there may be substitutions such as `$(var robot)`."""

    param_file: Text = field(
        metadata=required("The file; a relative path starts at the folder of the launch file.")
    )
    _: KW_ONLY
    allow_substs: bool | Text = option(
        False,
        "Whether to evaluate substitutions in its text. Nodes then get a temporary file, which is"
        " removed when the launch has ended.",
    )

    def perform(self, context: LaunchContext) -> str:
        path = PurePath(context.folder, resolve(self.param_file, context))
        if not to_bool(self.allow_substs, context):
            return str(path)
        # As in ROS 2 the text is evaluated before it is read as YAML: a substitution may be any part of it.
        text = resolve(template(context.library.text(str(path))), context)
        return context.library.temporary_file(path.name, text)


@dataclass(frozen=True)
class _Call:
    """How a substitution is written, its class, and how many arguments it has."""

    form: str
    make: Callable[..., Substitution]
    least: int = 1
    most: int = 1


_CALLS: Final = {
    "all": _Call("$(all VALUE …)", logic.AllSubstitution, 0, MAX_ARGUMENTS),
    "and": _Call("$(and LEFT RIGHT)", logic.AndSubstitution, 2, 2),
    "anon": _Call("$(anon NAME)", library_substitutions.AnonName),
    "any": _Call("$(any VALUE …)", logic.AnySubstitution, 0, MAX_ARGUMENTS),
    "command": _Call("$(command 'PROGRAM ARGUMENT …')", library_substitutions.Command),
    "dirname": _Call("$(dirname)", ThisLaunchFileDir, 0, 0),
    "env": _Call("$(env NAME) or $(env NAME DEFAULT)", EnvironmentVariable, 1, 2),
    "equals": _Call("$(equals LEFT RIGHT)", logic.EqualsSubstitution, 2, 2),
    "eval": _Call("$(eval 'EXPRESSION')", PythonExpression),
    "file-content": _Call("$(file-content PATH)", library_substitutions.FileContent),
    "filename": _Call("$(filename)", ThisLaunchFile, 0, 0),
    "find-exec": _Call("$(find-exec NAME)", library_substitutions.FindExecutable),
    "exec-in-pkg": _Call("$(exec-in-pkg PROGRAM PACKAGE)", library_substitutions.ExecutableInPackage, 2, 2),
    "find-pkg-prefix": _Call("$(find-pkg-prefix PACKAGE)", library_substitutions.FindPackagePrefix),
    "find-pkg-share": _Call("$(find-pkg-share PACKAGE)", library_substitutions.FindPackageShare),
    "launch_log_dir": _Call("$(launch_log_dir)", library_substitutions.LaunchLogDir, 0, 0),
    "log_dir": _Call("$(log_dir)", library_substitutions.LaunchLogDir, 0, 0),
    "if": _Call("$(if CONDITION THEN) or $(if CONDITION THEN ELSE)", logic.IfElseSubstitution, 2, 3),
    "not": _Call("$(not VALUE)", logic.NotSubstitution),
    "not-equals": _Call("$(not-equals LEFT RIGHT)", logic.NotEqualsSubstitution, 2, 2),
    "or": _Call("$(or LEFT RIGHT)", logic.OrSubstitution, 2, 2),
    "param": _Call("$(param NAME) or $(param NAME DEFAULT)", library_substitutions.Parameter, 1, 2),
    "path-join": _Call("$(path-join PART …)", lambda *parts: PathJoinSubstitution(parts), 1, MAX_ARGUMENTS),
    "var": _Call("$(var NAME) or $(var NAME DEFAULT)", LaunchConfiguration, 1, 2),
}
