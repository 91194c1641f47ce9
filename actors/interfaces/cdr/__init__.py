"""CDR: the bytes of ROS 2's messages, beside callboard's own msgpack.

    from actors.interfaces import cdr
    from actors.interfaces.geometry_msgs.msg import PoseStamped

    data = cdr.encode(PoseStamped())        # as rclpy's serialize_message
    message = cdr.decode(PoseStamped, data)

Messages are encoded as ROS 2 does with Fast DDS: plain CDR (XCDR version 1), little-endian, behind the four
bytes 00 01 00 00. Big-endian messages (00 00) are read, too. For each class an encoder and a decoder are
written in Python and compiled when they are first used. Imports the modules of `actors.interfaces`.
"""

from actors.interfaces.cdr.codec import CdrCodec, codec_for, decode, encode

__all__ = ["CdrCodec", "codec_for", "decode", "encode"]
