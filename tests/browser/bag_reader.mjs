// Prints the messages of an MCAP file, a line of JSON for each, as the libraries of Foxglove read them:
// node --input-type=module - FILE < bag_reader.mjs, in the folder that has `node_modules`.
import { open } from "node:fs/promises";

import { parse } from "@foxglove/rosmsg";
import { MessageReader } from "@foxglove/rosmsg2-serialization";
import { McapIndexedReader } from "@mcap/core";

const file = await open(process.argv[2]);
const readable = {
  size: async () => BigInt((await file.stat()).size),
  read: async (offset, length) => {
    const { buffer, bytesRead } = await file.read(new Uint8Array(Number(length)), 0, Number(length), Number(offset));
    return buffer.subarray(0, bytesRead);
  },
};

// JSON has no large integers, no infinity, and here no negative zero.
function exact(_, value) {
  if (typeof value === "bigint") return String(value);
  if (ArrayBuffer.isView(value)) return Array.from(value);
  if (typeof value !== "number" || (Number.isFinite(value) && !Object.is(value, -0))) return value;
  return Object.is(value, -0) ? "-0" : String(value);
}

const bag = await McapIndexedReader.Initialize({ readable });
const readers = new Map();
for await (const { channelId, logTime, publishTime, sequence, data } of bag.readMessages()) {
  const { topic, schemaId } = bag.channelsById.get(channelId);
  const schema = bag.schemasById.get(schemaId);
  if (!readers.has(schemaId)) {
    const definition = parse(new TextDecoder().decode(schema.data), { ros2: true });
    readers.set(schemaId, new MessageReader(definition));
  }
  const message = readers.get(schemaId).readMessage(data);
  console.log(JSON.stringify({ topic, type: schema.name, logTime, publishTime, sequence, message }, exact));
}
