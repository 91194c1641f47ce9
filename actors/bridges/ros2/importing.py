"""Finds ROS 2: rclpy, and the C functions below it that rclpy does not offer.

A sourced ROS 2 is used when there is one, because its setup script puts it into PYTHONPATH, in front of the
wheels of callboard's extra `ros2`. Nothing else of callboard imports rclpy.
"""

from __future__ import annotations

import ctypes
import os
import sys
from contextlib import contextmanager
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any, Final

from actors.bridges.ros2.errors import RosNotFoundError
from actors.bridges.ros2.message_taker import MessageTaker

if TYPE_CHECKING:
    from collections.abc import Generator

PROFILE_VARIABLE: Final = "FASTDDS_DEFAULT_PROFILES_FILE"
OLD_PROFILE_VARIABLE: Final = "FASTRTPS_DEFAULT_PROFILES_FILE"
"""That of Fast DDS 2, which Jazzy has; later rmw libraries warn about it."""
USER_PROFILE_FILES: Final = ("DEFAULT_FASTDDS_PROFILES.xml", "DEFAULT_FASTRTPS_PROFILES.xml")
"""What Fast DDS reads from the working directory."""

ANNOUNCEMENT_SEC: Final = 1
"""How often the participant renews its lease: with the shortest lease, two may be lost."""

_QUEUE: Final = (
    "<topic><resourceLimitsQos><allocated_samples>1</allocated_samples></resourceLimitsQos></topic>"
)
"""Queues grow with what waits in them. By default, Fast DDS allocates 100 samples for each beforehand: a
service takes 130 KiB in place of 38, a subscription 84 in place of 31, and most mirrors stay empty."""

_PROFILE: Final = """\
<?xml version="1.0" encoding="UTF-8" ?>
<profiles xmlns="http://www.eprosima.com">
  <participant profile_name="callboard_bridge" is_default_profile="true"><rtps>
    <propertiesPolicy><properties>
      <property><name>fastdds.ignore_local_endpoints</name><value>true</value></property>
    </properties></propertiesPolicy>
    <builtin><discovery_config>
      <leaseDuration><sec>{lease_sec}</sec></leaseDuration>
      <leaseAnnouncement><sec>{announcement_sec}</sec></leaseAnnouncement>
    </discovery_config></builtin>
  </rtps></participant>
  <data_writer profile_name="callboard_writer" is_default_profile="true">{queue}</data_writer>
  <data_reader profile_name="callboard_reader" is_default_profile="true">{queue}</data_reader>
</profiles>
"""
"""Endpoints of one participant do not match: mirrors of one topic do not feed each other."""

_INSTALLED: Final = "wheels for Linux on x86-64: pip install '.[ros2]' in a clone of callboard"
"""Without the names of its packages, as other extras have them: there are thirty."""

ARRIVAL_FUNCTIONS: Final = (
    "rcl_subscription_set_on_new_message_callback",
    "rcl_service_set_on_new_request_callback",
    "rcl_client_set_on_new_response_callback",
)
"""Set a C function that ROS 2's own threads call: `(entity, function, user data)`."""


def profile_text(lease_sec: int) -> str:
    """Return the bridge's profile for Fast DDS; `lease_sec` as for `Ros.profile`."""
    return _PROFILE.format(lease_sec=lease_sec, announcement_sec=ANNOUNCEMENT_SEC, queue=_QUEUE)


@dataclass(frozen=True, kw_only=True)
class Ros:
    """ROS 2 in this process.

    Attributes:
        rclpy: The package.
        implementation: Its C extension.
        rcl: The C library below it.
        taker: Takes messages as bytes.
        eventfd_write: Address of the C library's function, which has the signature of an arrival callback.
        distribution: "sourced" or "wheels".
        rmw: Name of the middleware, such as "rmw_fastrtps_cpp".
        has_own_profile: Whether the bridge sets up Fast DDS. Otherwise, the user's profile applies or the
            middleware is another one: endpoints of the bridge match each other, and a killed bridge stays in
            ROS 2's graph for the lease of that middleware.
    """

    rclpy: Any
    implementation: Any
    rcl: Any
    taker: MessageTaker
    eventfd_write: int
    distribution: str
    rmw: str
    has_own_profile: bool

    @contextmanager
    def profile(self, lease_sec: int) -> Generator[None]:
        """Give Fast DDS the bridge's profile; it reads the file for its first participant.

        Args:
            lease_sec: How long other processes show the participant after it was killed.
        """
        if not self.has_own_profile:
            yield
            return
        with TemporaryDirectory(prefix="callboard-bridge-") as folder:
            path = Path(folder, "fastdds.xml")
            path.write_text(profile_text(lease_sec), encoding="utf-8")
            is_old = "/libfastrtps.so" in Path("/proc/self/maps").read_text(encoding="utf-8")
            variable = OLD_PROFILE_VARIABLE if is_old else PROFILE_VARIABLE
            os.environ[variable] = str(path)
            try:
                yield
            finally:
                del os.environ[variable]  # child processes are not bridges


def import_ros() -> Ros:
    """Import rclpy and find the C functions that a bridge needs.

    Raises:
        RosNotFoundError: There is no ROS 2, it is for another Python or too old, or callboard's own `rclpy`
            is imported in this process.
    """
    prefixes = os.environ.get("AMENT_PREFIX_PATH", "")
    # rcl writes its log lines to stdout otherwise, if the user has set it for his own nodes.
    os.environ["RCUTILS_LOGGING_USE_STDOUT"] = "0"
    try:
        rclpy: Any = import_module("rclpy")
    except ImportError as error:
        raise RosNotFoundError(_missing_text(prefixes, error)) from error
    if rclpy.__name__ != "rclpy":
        raise RosNotFoundError(
            "the bridge needs ROS 2's own rclpy, but this process has imported callboard's (actors.ros): "
            "start the bridge in a process of its own, with `callboard bridge ros2`"
        )
    try:
        implementation: Any = import_module("rclpy.impl.implementation_singleton").rclpy_implementation
        rmw = implementation.rclpy_get_rmw_implementation_identifier()
        for name in ("context", "node", "parameter", "qos", "signals", "event_handler", "callback_groups"):
            import_module(f"rclpy.{name}")
    except (ImportError, AttributeError, RuntimeError) as error:
        raise RosNotFoundError(_missing_text(prefixes, error)) from error
    is_sourced = any(Path(rclpy.__file__).is_relative_to(each) for each in prefixes.split(os.pathsep) if each)
    rcl, taker, eventfd_write = _c_functions()
    return Ros(
        rclpy=rclpy,
        implementation=implementation,
        rcl=rcl,
        taker=taker,
        eventfd_write=eventfd_write,
        distribution="sourced" if is_sourced else "wheels",
        rmw=rmw,
        has_own_profile=rmw.startswith("rmw_fastrtps") and not _has_user_profile(),
    )


def _missing_text(prefixes: str, error: Exception) -> str:
    reason = str(error).splitlines()[0]
    if prefixes:
        version = ".".join(map(str, sys.version_info[:2]))
        return (
            f"rclpy of the sourced ROS 2 ({prefixes}) does not work in Python {version}: {reason}. Run "
            "callboard with the Python of that ROS 2 (3.11 or later), or in a shell where it is not sourced, "
            f"with {_INSTALLED}"
        )
    return (
        f"the bridge needs ROS 2's rclpy ({reason}): source a ROS 2 (Jazzy or later) for this Python, or "
        f"install its {_INSTALLED}"
    )


def _has_user_profile() -> bool:
    return any(os.environ.get(name) for name in (PROFILE_VARIABLE, OLD_PROFILE_VARIABLE)) or any(
        Path(name).exists() for name in USER_PROFILE_FILES
    )


def _c_functions() -> tuple[Any, MessageTaker, int]:
    """Return librcl, as rclpy has loaded it, what takes messages, and the address of `eventfd_write`."""
    try:
        rcl = ctypes.CDLL("librcl.so", mode=os.RTLD_NOLOAD | os.RTLD_NOW)
        for name in ARRIVAL_FUNCTIONS:
            function = getattr(rcl, name)
            function.argtypes, function.restype = [ctypes.c_void_p] * 3, ctypes.c_int
        rcl.rcl_node_get_graph_guard_condition.argtypes = [ctypes.c_void_p]
        rcl.rcl_node_get_graph_guard_condition.restype = ctypes.c_void_p
        rcl.rcl_wait_set_add_guard_condition.argtypes = [ctypes.c_void_p] * 3
        rcl.rcl_wait_set_add_guard_condition.restype = ctypes.c_int
        taker = MessageTaker(rcl)
        write = ctypes.cast(ctypes.CDLL(None).eventfd_write, ctypes.c_void_p).value
    except (OSError, AttributeError) as error:
        raise RosNotFoundError(f"the bridge needs ROS 2 Jazzy or later, on Linux: {error}") from error
    assert write is not None
    return rcl, taker, write
