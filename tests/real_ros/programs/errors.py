"""The names of exceptions, by which the answers of two sides are compared."""

from __future__ import annotations

from rclpy import exceptions, executors, parameter, qos

MODULES = (exceptions, executors, parameter, qos)
"""Those with rclpy's names for classes that callboard's own code has under another one."""


def error_names(error):
    """Return the names of an exception's class and of its bases, its own first: what `except` could name."""
    classes = [cls for cls in type(error).__mro__ if issubclass(cls, Exception)]
    aliases = [name for module in MODULES for name, value in vars(module).items() if value in classes]
    return [*dict.fromkeys([*(cls.__name__ for cls in classes), *aliases])]


def outcome(function, *args, **options):
    """Return what a function returns, or what it raises."""
    try:
        return function(*args, **options)
    except Exception as error:  # noqa: BLE001 - whatever a program raises is its answer
        return {"raises": error_names(error)}
