#!/usr/bin/env bash
# The npm packages @foxglove/rosmsg2-serialization 3.1.0 and @foxglove/rosmsg 5.0.5, seen on 2026-11-28.
#
# Some types of ROS 2 have constants and no fields: rcl_interfaces/msg/ParameterType, statistics_msgs/msg/StatisticDataType.
# Their messages are legal, and one byte long, as those of std_msgs/msg/Empty, which has neither.
#
# Guess: messages of both kinds are read as objects without fields.
# Seen: those of the type without constants are. For the one with constants, making a reader (or a writer) throws
#       "MessageReader initialized with no root MessageDefinition": it skips definitions that have only constants, as ros2idl
#       has them in modules beside the message, also where there is nothing else.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
npm install --silent --no-audit --no-fund @foxglove/rosmsg@5.0.5 @foxglove/rosmsg2-serialization@3.1.0
cat > read.mjs <<'JAVASCRIPT'
import { parse } from "@foxglove/rosmsg";
import { MessageReader } from "@foxglove/rosmsg2-serialization";

function read(definition) {
  try {
    const reader = new MessageReader(parse(definition, { ros2: true }));
    return JSON.stringify(reader.readMessage(new Uint8Array([0, 1, 0, 0, 0])));
  } catch (error) {
    return error.message;
  }
}

const found = [read(""), read("uint8 A=1\n")];
console.log(found.join("\n"));
process.exit(found[0] === "{}" && found[1].includes("no root MessageDefinition") ? 0 : 1);
JAVASCRIPT
node read.mjs || { echo "It is no longer so." >&2; exit 1; }
