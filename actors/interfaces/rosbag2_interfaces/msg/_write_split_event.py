"""rosbag2_interfaces/msg/WriteSplitEvent."""

from actors.interfaces.message import Message


class WriteSplitEvent(Message, type_name="rosbag2_interfaces/msg/WriteSplitEvent"):
    """A recorder has gone on to the next file of a bag."""

    closed_file: str = ""
    """Path of the file that is complete."""
    opened_file: str = ""
    """Path of the file that is written from now on."""
    node_name: str = ""
    """Full name of the recorder's node."""
