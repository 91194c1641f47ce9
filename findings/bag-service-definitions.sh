#!/usr/bin/env bash
# rosbags 0.11.9 and mcap-ros2-support 0.6.0 with mcap 1.6.0 (Python 3.11), and the npm package @foxglove/rosmsg 5.0.5,
# seen on 2026-11-28.
#
# rosbag2 records the calls of a service on a topic `.../_service_event`, and describes the type by the text of its .srv
# file (rosbag2, docs/message_definition_encoding.md: request, `---`, response).
#
# Guess: a library that knows only messages leaves that topic out, and reads the others.
# Seen: rosbags' AnyReader cannot open the recording at all, even if the service was never called. mcap-ros2-support reads
#       up to the first call and then raises, unless the other topics are asked for by name. @foxglove/rosmsg cannot
#       parse the text.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3.11 -m venv "$folder/env"
"$folder/env/bin/pip" install --quiet --disable-pip-version-check rosbags==0.11.9 mcap==1.6.0 mcap-ros2-support==0.6.0
cd "$folder"
npm install --silent --no-audit --no-fund @foxglove/rosmsg@5.0.5
"$folder/env/bin/python" - <<'PYTHON' || { echo "It is no longer so." >&2; exit 1; }
import sys
from pathlib import Path

from mcap.reader import make_reader
from mcap.writer import Writer
from mcap_ros2.decoder import DecoderFactory
from rosbags.highlevel import AnyReader

SERVICE = b"int64 a\nint64 b\n---\nint64 sum\n"


def recording(path, calls):
    """Write one message of a topic, and a service with this many calls; None for no service."""
    with path.open("wb") as file:
        writer = Writer(file)
        writer.start("ros2")
        schema = writer.register_schema("std_msgs/msg/String", "ros2msg", b"string data")
        texts = writer.register_channel("/texts", "cdr", schema, {"offered_qos_profiles": ""})
        writer.add_message(texts, 1, b"\0\1\0\0\2\0\0\0x\0", 1)
        if calls is not None:
            schema = writer.register_schema("example_interfaces/srv/AddTwoInts_Event", "ros2msg", SERVICE)
            events = writer.register_channel("/add/_service_event", "cdr", schema)
            for _ in range(calls):
                writer.add_message(events, 2, b"\0\1\0\0" + bytes(60), 2)
        writer.finish()
    return path


def by_mcap(path, topics=None):
    with path.open("rb") as file:
        reader = make_reader(file, decoder_factories=[DecoderFactory()])
        return [decoded.data for _, _, _, decoded in reader.iter_decoded_messages(topics=topics)]


def by_rosbags(path):
    with AnyReader([path]) as reader:
        texts = [each for each in reader.connections if each.topic == "/texts"]
        return [reader.deserialize(raw, each.msgtype).data for each, _, raw in reader.messages(connections=texts)]


def tried(read, *arguments):
    try:
        return read(*arguments)
    except Exception as error:
        return type(error).__name__


found = {}
for name, calls in {"no service": None, "no call": 0, "one call": 1}.items():
    path = recording(Path(f"{calls}.mcap"), calls)
    found[name] = [tried(by_rosbags, path), tried(by_mcap, path), tried(by_mcap, path, ["/texts"])]
    print(name, found[name])
sys.exit(
    found
    != {
        "no service": [["x"], ["x"], ["x"]],
        "no call": ["AnyReaderError", ["x"], ["x"]],
        "one call": ["AnyReaderError", "InvalidFieldDefinition", ["x"]],
    }
)
PYTHON
cat > parse.mjs <<'JAVASCRIPT'
import { parse } from "@foxglove/rosmsg";

try {
  parse("int64 a\nint64 b\n---\nint64 sum\n", { ros2: true });
  process.exit(1);
} catch (error) {
  console.log("@foxglove/rosmsg", error.message.split("\n")[0]);
}
JAVASCRIPT
node parse.mjs || { echo "It is no longer so." >&2; exit 1; }
