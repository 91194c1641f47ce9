#!/usr/bin/env bash
# mcap-ros2-support 0.6.0 (Python 3.11) and the npm package @foxglove/rosmsg2-serialization 3.1.0 with @foxglove/rosmsg
# 5.0.5, seen on 2026-11-28.
#
# Two libraries write messages of ROS 2 into recordings. Fields that the program leaves out get the definition's default.
#
# Guess: `int32 x 7`, `int32[2] pair [3, 4]` and `int32[] list [1, 2]` are written as 7, [3, 4] and [1, 2], as ROS 2 has it.
# Seen: both write the 7 and, in silence, an empty `list`. @foxglove/rosmsg2-serialization keeps the default of an array of
#       fixed length; mcap-ros2-support refuses to write a type that has one: "Default value for primitive types cannot be
#       an array", even when the program gives the field a value.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3.11 -m venv "$folder/env"
"$folder/env/bin/pip" install --quiet --disable-pip-version-check mcap==1.6.0 mcap-ros2-support==0.6.0
cd "$folder"
npm install --silent --no-audit --no-fund @foxglove/rosmsg@5.0.5 @foxglove/rosmsg2-serialization@3.1.0
"$folder/env/bin/python" - <<'PYTHON' || { echo "It is no longer so." >&2; exit 1; }
import io
import sys

from mcap_ros2.reader import read_ros2_messages
from mcap_ros2.writer import Writer


def written(text, values):
    """Write a message and read it back; return its fields, or the error's text."""
    file = io.BytesIO()
    writer = Writer(file)
    try:
        writer.write_message("/probe", writer.register_msgdef("probe_msgs/msg/Probe", text), values, log_time=1)
    except ValueError as error:
        return str(error)
    writer.finish()
    file.seek(0)
    (message,) = (item.ros_msg for item in read_ros2_messages(file))
    return {name: getattr(message, name) for name in message.__slots__}


sequence = written("int32 x 7\nint32[] list [1, 2]\n", {})
array = written("int32[2] pair [3, 4]\n", {"pair": [5, 6]})
print(sequence, array)
sys.exit((sequence, array) != ({"x": 7, "list": []}, "Default value for primitive types cannot be an array"))
PYTHON
cat > write.mjs <<'JAVASCRIPT'
import { parse } from "@foxglove/rosmsg";
import { MessageReader, MessageWriter } from "@foxglove/rosmsg2-serialization";

const definition = parse("int32 x 7\nint32[2] pair [3, 4]\nint32[] list [1, 2]\n", { ros2: true });
const message = new MessageReader(definition).readMessage(new MessageWriter(definition).writeMessage({}));
const found = JSON.stringify([message.x, [...message.pair], [...message.list]]);
console.log("@foxglove/rosmsg2-serialization", found);
process.exit(found === "[7,[3,4],[]]" ? 0 : 1);
JAVASCRIPT
node write.mjs || { echo "It is no longer so." >&2; exit 1; }
