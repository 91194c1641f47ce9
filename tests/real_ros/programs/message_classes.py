"""What message classes of ROS 2 have: names, containers, checks."""

from __future__ import annotations

import array
import copy
import pickle
from importlib import import_module

import numpy as np
import std_msgs.msg
import std_srvs.srv
from geometry_msgs.msg import PoseStamped, PoseWithCovariance
from rclpy.client import SrvTypeRequest
from rclpy.publisher import MsgType
from rclpy.qos import DurabilityPolicy, QoSProfile
from rclpy.serialization import deserialize_message, serialize_message
from sensor_msgs.msg import CameraInfo, CompressedImage, Imu, JointState, LaserScan, NavSatStatus
from service_msgs.msg import ServiceEventInfo
from std_msgs.msg import ByteMultiArray, Float64MultiArray, String, UInt8MultiArray
from std_srvs.srv import SetBool, SetBool_Event, SetBool_Request
from unique_identifier_msgs.msg import UUID

from tests.real_ros.programs.errors import outcome
from tests.real_ros.programs.message_types import plain
from tests.real_ros.programs.running import running_node, spin_until

PACKAGES = ("geometry_msgs.msg", "sensor_msgs.msg", "std_srvs.srv", "action_msgs.srv", "rcl_interfaces.srv")


def names_in_packages():
    """List what packages have."""
    modules = (std_msgs.msg, std_srvs.srv)
    return [[name for name in dir(each) if name[0].isupper() and name != "TYPE_CHECKING"] for each in modules]


def names_of_classes():
    """Ask classes for their module and names, as generators and bridges do."""
    found = []
    for name in PACKAGES:
        module = import_module(name)
        classes = [
            getattr(module, each) for each in dir(module) if each[0].isupper() and each != "TYPE_CHECKING"
        ]
        found += [[each.__module__, each.__name__, each.__qualname__] for each in classes]
    return found


def fields_of_classes():
    """Ask for their fields in the ways that libraries have."""
    classes = (PoseStamped, CameraInfo, SetBool.Response, UUID)
    names = ("__slots__", "_fields_and_field_types")
    return [[*(getattr(each, name) for name in names), len(each.SLOT_TYPES)] for each in classes]


def constants_of_classes():
    """Read constants as `ros2 service echo` does."""
    parts = (ServiceEventInfo, "ServiceEventInfo"), (NavSatStatus, "NavSatStatus"), (String, "String")
    constants = [getattr(cls, f"_Metaclass_{name}__constants") for cls, name in parts]
    return [*constants, SetBool_Request._Metaclass_SetBool_Request__constants]  # noqa: SLF001


def names_that_can_be_imported():
    """Import parts of a service, and type variables."""
    parts = [SetBool_Request is SetBool.Request, SetBool_Event.__name__, SrvTypeRequest.__name__]
    services, actions = import_module("std_srvs.srv._set_bool"), import_module("test_msgs.action._fibonacci")
    names = ("Feedback", "FeedbackMessage", "SendGoal", "GetResult_Response")
    parts += [
        services.SetBool_Event.__name__,
        *(getattr(actions, f"Fibonacci_{each}").__name__ for each in names),
    ]
    parts.append(hasattr(actions, "Fibonacci_Other"))
    return [*parts, MsgType.__name__, services.SetBool_Response.__qualname__]


def _types(message):
    return {
        name: f"{type(getattr(message, name)).__module__}.{type(getattr(message, name)).__name__}"
        for name in message.get_fields_and_field_types()
    }


MESSAGES = (CompressedImage, CameraInfo, Imu, JointState, LaserScan, ByteMultiArray, UUID, Float64MultiArray)


def containers_of_new_messages():
    """Look at the classes of new fields."""
    return [_types(cls()) for cls in MESSAGES]


def containers_of_received_messages():
    """Look at those of received fields."""
    return [_types(deserialize_message(serialize_message(cls()), cls)) for cls in MESSAGES]


def new_fields_change_in_place():
    """Add to the fields of new messages."""
    image, pose, joints = CompressedImage(), PoseWithCovariance(), JointState()
    image.data.frombytes(b"abc")
    image.data.append(1)
    pose.covariance[:] = np.arange(36)
    pose.covariance[0] = 7.5
    joints.position.extend([1.0, 2.0])
    joints.name.append("a")
    other = [plain(each) for each in (CompressedImage(), PoseWithCovariance(), JointState())]
    sent = [plain(deserialize_message(serialize_message(each), type(each))) for each in (image, pose, joints)]
    return [sent, other]


def fixed_fields_are_numpy_arrays():
    """Compute with them."""
    info = CameraInfo(k=[float(each) for each in range(9)])
    scaled = Imu().orientation_covariance + 1.5
    return [info.k.reshape(3, 3).tolist(), (info.k * 2).tolist(), scaled.tolist(), str(info.k.dtype)]


def assigned_sequences_are_copied():
    """Change what was assigned or given to a constructor."""
    numbers, octets, fixed = np.ones(2), array.array("B", [1, 2]), np.ones(9)
    assigned, other = Float64MultiArray(), UInt8MultiArray(data=octets)
    assigned.data, given, info = numbers, Float64MultiArray(data=numbers), CameraInfo(k=fixed)
    numbers[0], octets[0], fixed[0] = 9, 9, 9
    return [plain(each) for each in (assigned, given, other, info)]


def lists_become_arrays():
    """Assign lists before anything is published."""
    message = Float64MultiArray()
    message.data = [1, 2]
    message.data.append(3)
    return [_types(message)["data"], message.data.tolist(), type(Float64MultiArray(data=[1.0]).data).__name__]


def wrong_sequences():
    """Assign what is no sequence of numbers."""

    def assigned(value):
        message = Float64MultiArray()
        message.data = value

    return [outcome(assigned, each) for each in (None, "text", ["a"], 5, [None])]


def checked_fields():
    """Check the fields of one message."""
    message = String(check_fields=True)

    def wrong(value):
        message.data = value

    message.data = "right"
    return [
        outcome(String, data=5, check_fields=True),
        outcome(wrong, 5),
        String(data=5, check_fields=False).data,
        message == String(data="right"),
        String(data="right") == message,
        isinstance(message, String),
        message.data,
        plain(deserialize_message(serialize_message(message), String)),
    ]


def copies():
    """Copy and pickle messages."""
    message = CameraInfo(k=[1.0] * 9, d=[2.0])
    deep, shallow = copy.deepcopy(message), copy.copy(message)
    pickled = pickle.loads(pickle.dumps(message))
    deep.k[0], shallow.d[0] = 5, 6
    request = pickle.loads(pickle.dumps(SetBool.Request(data=True)))
    return [plain(each) for each in (message, deep, pickled, request)]


class _Labelled(CameraInfo):
    """A program's own, with attributes beside the fields."""

    def __init__(self, model, **fields):
        super().__init__(distortion_model=model, **fields)
        self.label = model.upper()


class _Derived(_Labelled):
    pass


def subclasses():
    """Make, copy and send messages of a program's subclasses, one with an `__init__`."""
    message, derived = _Labelled("plumb", k=[1.0] * 9), _Derived("fisheye")
    deep, pickled = copy.deepcopy(message), pickle.loads(pickle.dumps(derived))
    deep.k[0] = 5
    received = deserialize_message(serialize_message(message), CameraInfo)
    return [
        *(plain(each) for each in (message, derived, deep, pickled, received)),
        [type(each).__name__ for each in (message, derived, deep, pickled, message.k, received)],
        [each.label for each in (message, derived, deep, pickled)],
        deep == copy.deepcopy(deep),
        outcome(_Labelled),
        outcome(_Labelled, "a", check_fields=False).height,
    ]


class _Renamed(String):
    """Another one, without an `__init__`."""

    def length(self):
        """Return the length of the text."""
        return len(self.data)


def types_of_subclasses():
    """Use a program's subclass where the class of ROS 2 is used, too."""
    with running_node() as node:
        received = []
        latched = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
        publisher = node.create_publisher(_Renamed, "t", latched)
        node.create_subscription(String, "t", received.append, latched)
        message = _Renamed(data="abc")
        message.note, message.other = 1, 2
        publisher.publish(message)
        spin_until(node, lambda: received)
        copied, pickled = copy.copy(message), pickle.loads(pickle.dumps(message))
        return [
            dict(node.get_topic_names_and_types())["/t"],
            [each.data for each in received],
            [message.length(), copied.note, copied.other, pickled.other],
            outcome(publisher.publish, String()),
            type("Slotted", (String,), {"__slots__": ["note"]})().data,
        ]
