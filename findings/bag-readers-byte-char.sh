#!/usr/bin/env bash
# rosbags 0.11.9, mcap-ros2-support 0.6.0 (Python 3.11) and the npm package @foxglove/rosmsg2-serialization 3.1.0 with
# @foxglove/rosmsg 5.0.5, seen on 2026-11-28.
#
# Three libraries read messages of ROS 2 from recordings. The fields are `char c` and `byte b`, the bytes 200 and 201.
#
# Guess: all read both types as numbers from 0 to 255, as ROS 2 has them since Dashing.
# Seen: rosbags reads `byte` as signed (-55), mcap-ros2-support reads `char` as signed (-56); each is right about the other
#       type, and @foxglove/rosmsg2-serialization about both. Arrays differ, too: rosbags reads `byte[2]` as signed, but
#       mcap-ros2-support gives bytes. So one recording shows three different messages.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3.11 -m venv "$folder/env"
"$folder/env/bin/pip" install --quiet --disable-pip-version-check rosbags==0.11.9 mcap==1.6.0 mcap-ros2-support==0.6.0
cd "$folder"
npm install --silent --no-audit --no-fund @foxglove/rosmsg@5.0.5 @foxglove/rosmsg2-serialization@3.1.0
"$folder/env/bin/python" - <<'PYTHON' || { echo "It is no longer so." >&2; exit 1; }
import io
import sys

from mcap.writer import Writer
from mcap_ros2.reader import read_ros2_messages
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

TEXT = "char c\nbyte b\nchar[2] cs\nbyte[2] bs\n"
DATA = bytes([0, 1, 0, 0, 200, 201, 200, 1, 201, 1])
NAME = "probe_msgs/msg/Probe"

store = get_typestore(Stores.ROS2_KILTED)
store.register(get_types_from_msg(TEXT, NAME))
by_rosbags = store.deserialize_cdr(DATA, NAME)

file = io.BytesIO()
writer = Writer(file)
writer.start(profile="ros2")
schema = writer.register_schema(name=NAME, encoding="ros2msg", data=TEXT.encode())
channel = writer.register_channel("/probe", "cdr", schema)
writer.add_message(channel, log_time=1, data=DATA, publish_time=1)
writer.finish()
file.seek(0)
(by_mcap,) = (item.ros_msg for item in read_ros2_messages(file))

found = {
    "rosbags": [by_rosbags.c, by_rosbags.b, by_rosbags.cs.tolist(), by_rosbags.bs.tolist()],
    "mcap-ros2-support": [by_mcap.c, by_mcap.b, list(by_mcap.cs), list(by_mcap.bs)],
}
print(found)
sys.exit(found != {"rosbags": [200, -55, [200, 1], [-55, 1]], "mcap-ros2-support": [-56, 201, [-56, 1], [201, 1]]})
PYTHON
cat > read.mjs <<'JAVASCRIPT'
import { parse } from "@foxglove/rosmsg";
import { MessageReader } from "@foxglove/rosmsg2-serialization";

const definition = parse("char c\nbyte b\nchar[2] cs\nbyte[2] bs\n", { ros2: true });
const message = new MessageReader(definition).readMessage(new Uint8Array([0, 1, 0, 0, 200, 201, 200, 1, 201, 1]));
const found = JSON.stringify([message.c, message.b, [...message.cs], [...message.bs]]);
console.log("@foxglove/rosmsg2-serialization", found);
process.exit(found === "[200,201,[200,1],[201,1]]" ? 0 : 1);
JAVASCRIPT
node read.mjs || { echo "It is no longer so." >&2; exit 1; }
