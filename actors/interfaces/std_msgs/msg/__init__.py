"""Messages of std_msgs."""

from actors.interfaces.std_msgs.msg._string import String as String
