"""Takes messages as bytes, by the C function that rclpy calls as well.

rclpy of Jazzy does not tell who has published a message. Later versions do, but all allocate a buffer for
each message: one of 1 MiB costs five times as much to take.
"""

from __future__ import annotations

import ctypes
import os
import struct
from typing import Any, ClassVar, Final, NamedTuple

from actors.bridges.ros2.errors import RosError

_TAKE_FAILED: Final = 401
"""RCL_RET_SUBSCRIPTION_TAKE_FAILED: nothing has arrived."""

_INFO: Final = struct.Struct("@qqQQP16s")
"""rmw_message_info_t up to the publisher's gid: stamps, sequence numbers, the middleware's name."""
_INFO_SIZE: Final = 256
"""More than it has in any version."""


class RosMessageInfo(NamedTuple):
    """What ROS 2 says about a message.

    Attributes:
        gid: The publisher.
        sequence: Its number among the publisher's messages.
        source_ns: When it was published.
        received_ns: When it arrived.
    """

    gid: bytes
    sequence: int
    source_ns: int
    received_ns: int


class _Allocator(ctypes.Structure):
    """rcutils_allocator_t: four functions and their state."""

    _fields_: ClassVar = [
        (name, ctypes.c_void_p) for name in ("allocate", "free", "resize", "zeros", "state")
    ]


class _Message(ctypes.Structure):
    """rcl_serialized_message_t."""

    _fields_: ClassVar = [
        ("buffer", ctypes.c_void_p),
        ("length", ctypes.c_size_t),
        ("capacity", ctypes.c_size_t),
        ("allocator", _Allocator),
    ]
    buffer: int
    length: int
    capacity: int


class MessageTaker:
    """The function, and the buffers that it fills; it belongs to one thread.

    The buffer stays as large as the largest message that was taken.

    Args:
        rcl: librcl.

    Raises:
        AttributeError: It lacks the function.
        OSError: librcutils is not loaded.
    """

    def __init__(self, rcl: Any) -> None:
        pointer = ctypes.c_void_p
        utilities: Any = ctypes.CDLL("librcutils.so", mode=os.RTLD_NOLOAD | os.RTLD_NOW)
        self._reset_error = utilities.rcutils_reset_error
        self._reset_error.argtypes, self._reset_error.restype = [], None
        utilities.rcutils_get_default_allocator.restype = _Allocator
        utilities.rcutils_uint8_array_init.argtypes = [pointer, ctypes.c_size_t, pointer]
        allocator = utilities.rcutils_get_default_allocator()
        self._taken = _Message()
        self._info = ctypes.create_string_buffer(_INFO_SIZE)
        utilities.rcutils_uint8_array_init(ctypes.addressof(self._taken), 0, ctypes.addressof(allocator))
        self._take = rcl.rcl_take_serialized_message
        self._take.argtypes, self._take.restype = [pointer] * 4, ctypes.c_int

    def take(self, subscription: int) -> tuple[bytes, RosMessageInfo] | None:
        """Take a message.

        Args:
            subscription: The pointer of rclpy's handle, which must be in use.

        Returns:
            The message in CDR and what ROS 2 says about it; None if nothing has arrived.

        Raises:
            RosError: ROS 2 refuses.
        """
        taken, info = self._taken, self._info
        code = self._take(subscription, ctypes.addressof(taken), ctypes.addressof(info), None)
        if code == _TAKE_FAILED:
            return None
        if code:
            self._reset_error()
            raise RosError(f"ROS 2 does not hand over a message: code {code}")
        source_ns, received_ns, sequence, _, _, gid = _INFO.unpack_from(info)
        about = RosMessageInfo(gid, sequence, source_ns, received_ns)
        return ctypes.string_at(taken.buffer, taken.length), about
