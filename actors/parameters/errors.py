"""Errors of parameters.

CallboardError
└── ParameterError                       base; `parameter` is the parameter's name
    ├── ParameterAlreadyDeclaredError    declared before
    ├── ParameterNotDeclaredError        used without being declared
    ├── ParameterUninitializedError      declared with a type only, and read before it was set
    ├── ParameterImmutableError          read only
    ├── ParameterModifiedInCallbackError changed while a callback decides about values
    ├── InvalidParameterError (ValueError)        a name that no parameter can have
    ├── InvalidParameterTypeError (TypeError)     a value of another type than declared
    ├── InvalidParameterValueError (ValueError)   a value that the descriptor or a callback refuses
    └── InvalidParameterFileError (ValueError)    a parameter file that cannot be used
"""

from __future__ import annotations

from proto.errors import CallboardError
from proto.untrusted_text import peer_text


class ParameterError(CallboardError):
    """Base of the errors about a parameter.

    Attributes:
        parameter: The parameter's name, or the file's.
    """

    def __init__(self, message: str, parameter: str) -> None:
        super().__init__(f"{message}: {peer_text(parameter)}")
        self.parameter = parameter


class ParameterAlreadyDeclaredError(ParameterError):
    """A parameter is declared twice."""

    def __init__(self, parameter: str) -> None:
        super().__init__("Parameter(s) already declared", parameter)


class ParameterNotDeclaredError(ParameterError):
    """A parameter is read, set or removed without having been declared."""

    def __init__(self, parameter: str) -> None:
        super().__init__("Invalid access to undeclared parameter(s)", parameter)


class ParameterUninitializedError(ParameterError):
    """A parameter that was declared with a type only is read before it has a value."""

    def __init__(self, parameter: str) -> None:
        super().__init__("The parameter is not initialized", parameter)


class ParameterImmutableError(ParameterError):
    """A read-only parameter is changed or removed."""

    def __init__(self, parameter: str) -> None:
        super().__init__("Attempted to modify read-only parameter", parameter)


class ParameterModifiedInCallbackError(ParameterError):
    """A pre-set or on-set callback declares, sets or removes a parameter; a post-set callback may."""

    def __init__(self, parameter: str) -> None:
        super().__init__(
            "Cannot declare, set or remove a parameter in a pre-set or on-set callback", parameter
        )


class InvalidParameterError(ParameterError, ValueError):
    """A name that no parameter can have."""

    def __init__(self, parameter: str) -> None:
        super().__init__("Invalid parameter name", parameter)


class InvalidParameterTypeError(ParameterError, TypeError):
    """A value has another type than the parameter was declared with."""

    def __init__(self, parameter: str, reason: str) -> None:
        super().__init__(f"Invalid parameter type. Reason: {reason}", parameter)
        self.reason = reason


class InvalidParameterValueError(ParameterError, ValueError):
    """A value is refused by the descriptor or by a callback."""

    def __init__(self, parameter: str, value: object, reason: str) -> None:
        super().__init__(f"Invalid parameter value ({value!r}) for parameter. Reason: {reason}", parameter)
        self.value = value
        self.reason = reason


class InvalidParameterFileError(ParameterError, ValueError):
    """A parameter file cannot be read, or does not have ROS 2's form."""

    is_operational = True

    def __init__(self, path: str, reason: str) -> None:
        super().__init__(f"Invalid parameter file ({reason})", path)
        self.reason = reason


ParameterException = ParameterError
ParameterAlreadyDeclaredException = ParameterAlreadyDeclaredError
ParameterNotDeclaredException = ParameterNotDeclaredError
ParameterUninitializedException = ParameterUninitializedError
ParameterImmutableException = ParameterImmutableError
InvalidParameterException = InvalidParameterError
InvalidParameterTypeException = InvalidParameterTypeError
InvalidParameterValueException = InvalidParameterValueError
