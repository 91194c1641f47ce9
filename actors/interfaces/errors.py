"""Errors of message types and messages.

    CallboardError (proto.errors)
    ├── InvalidMessageError (ValueError)   a value does not fit its field, or bytes are not such a message
    │   └── MessageBudgetError             a message would take too much memory for its bytes
    ├── InterfaceSyntaxError (ValueError)  a .msg, .srv or .action file breaks a rule; says file and line
    └── UnknownInterfaceError (LookupError) no message, service or action of that name can be imported

An object of another class (`publish("text")`) raises a plain `TypeError`, as in rclpy.
"""

from __future__ import annotations

from proto.errors import CallboardError


class InvalidMessageError(CallboardError, ValueError):
    """A message does not fit its type: the text names the type, the field's path and the expected value."""


class MessageBudgetError(InvalidMessageError):
    """A received message would take far more memory than its bytes.

    It leaves out fields, whose defaults take it: the sender should write every field of a large message. Or
    it is in CDR and has very many small elements. It was refused before that memory was taken.
    """


class InterfaceSyntaxError(CallboardError, ValueError):
    """An interface definition breaks a rule.

    ROS raises NameError, ValueError or TypeError here; callboard has one type for all.

    Attributes:
        source: The file, or a name for it.
        line: The line number, from 1; 0 for the whole file.
        reason: The broken rule and the remedy.
    """

    def __init__(self, source: str, line: int, reason: str) -> None:
        # With these arguments, and not one string, so that the error can be copied and pickled.
        super().__init__(source, line, reason)
        self.source = source
        self.line = line
        self.reason = reason

    def __str__(self) -> str:
        place = f"{self.source}:{self.line}" if self.line else self.source
        return f"{place}: {self.reason}"


class UnknownInterfaceError(CallboardError, LookupError):
    """No message, service or action type of that name can be imported."""
