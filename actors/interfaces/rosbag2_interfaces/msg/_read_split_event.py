"""rosbag2_interfaces/msg/ReadSplitEvent."""

from actors.interfaces.message import Message


class ReadSplitEvent(Message, type_name="rosbag2_interfaces/msg/ReadSplitEvent"):
    """A player has gone on to the next file of a bag."""

    closed_file: str = ""
    """Path of the file that has been read."""
    opened_file: str = ""
    """Path of the file that is read from now on."""
    node_name: str = ""
    """Full name of the player's node."""
