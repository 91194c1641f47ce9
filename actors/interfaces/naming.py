"""The ROS type name of a message class: declared, or derived from where the class was written."""

from __future__ import annotations

import copy
import sys
from array import array
from functools import partial
from pathlib import PurePath
from typing import Any, Final, cast, dataclass_transform, get_origin

import msgspec

from actors.interfaces.docstrings import Documentation

TYPE_NAME: Final = "__ros_type_name__"
"""The attribute, in the class's own dict, with a declared or derived name."""


def package_of(module: str) -> str:
    """Return the package part of a derived type name: the top module's name.

    A script's classes are in `__main__` when it runs and in the script's own module when another program
    imports it; both must have the same type name, or publisher and subscriber would not match.
    """
    if module == "__main__":
        main = sys.modules["__main__"]
        spec = getattr(main, "__spec__", None)
        file = getattr(main, "__file__", None)
        # `python -m package.module`: the module has a name, and its file may be called `__main__.py`.
        if spec is not None:
            module = str(spec.name)
        elif file:
            module = PurePath(str(file)).stem
        else:
            # An interactive session.
            module = "main"
    return module.partition(".")[0]


@dataclass_transform(field_specifiers=(msgspec.field,))
class MessageType(msgspec.StructMeta):
    """The class of message classes: accepts `type_name=` in addition to msgspec's options."""

    __doc__ = cast("str", Documentation(__doc__))

    def __new__(  # noqa: PYI034 - Self is not for metaclasses
        mcls,
        name: str,
        bases: tuple[type, ...],
        namespace: dict[str, Any],
        *,
        type_name: str | None = None,
        **options: Any,
    ) -> MessageType:
        """Make the class; `type_name` is its ROS name, such as "std_msgs/msg/String"."""
        # In the dict of each class, also as None: a subclass must not inherit the name of its base.
        namespace[TYPE_NAME] = type_name
        # `pose: Pose = Pose()` would be one Pose for all messages.
        for field, value in namespace.items():
            if isinstance(value, array) or hasattr(value, "dtype") or isinstance(type(value), MessageType):
                namespace[field] = msgspec.field(default_factory=partial(copy.deepcopy, value))
            elif cast("Any", get_origin(getattr(value, "default_factory", None))) is list:
                # `list[Pose]` satisfies type checkers, but to call it takes ten times as long.
                namespace[field] = msgspec.field(default_factory=list)
        return super().__new__(mcls, name, bases, namespace, **options)


def message_name(cls: type) -> str:
    """Return the ROS type name of a message class: "std_msgs/msg/String"."""
    name: str | None = cls.__dict__.get(TYPE_NAME)
    if name is None:
        # Not when the class is made, since a service or an action gives its parts names of their own
        # afterwards.
        name = f"{package_of(cls.__module__)}/msg/{cls.__name__}"
        setattr(cls, TYPE_NAME, name)
    return name
