"""Messages from and to plain values, and interfaces by name: programs import this as `rosidl_runtime_py`."""

from actors.ros.rosidl_runtime_py.convert import get_message_slot_types as get_message_slot_types
from actors.ros.rosidl_runtime_py.convert import message_to_csv as message_to_csv
from actors.ros.rosidl_runtime_py.convert import message_to_ordereddict as message_to_ordereddict
from actors.ros.rosidl_runtime_py.convert import message_to_yaml as message_to_yaml
from actors.ros.rosidl_runtime_py.get_interfaces import get_action_interfaces as get_action_interfaces
from actors.ros.rosidl_runtime_py.get_interfaces import get_interface_packages as get_interface_packages
from actors.ros.rosidl_runtime_py.get_interfaces import get_interface_path as get_interface_path
from actors.ros.rosidl_runtime_py.get_interfaces import get_interfaces as get_interfaces
from actors.ros.rosidl_runtime_py.get_interfaces import get_message_interfaces as get_message_interfaces
from actors.ros.rosidl_runtime_py.get_interfaces import get_service_interfaces as get_service_interfaces
from actors.ros.rosidl_runtime_py.import_message import (
    import_message_from_namespaced_type as import_message_from_namespaced_type,
)
from actors.ros.rosidl_runtime_py.set_message import set_message_fields as set_message_fields
