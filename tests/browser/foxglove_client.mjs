// A client of Foxglove's own: does what a person does in Foxglove, and prints what it gets, a line of JSON for each:
// node --input-type=module - ADDRESS < foxglove_client.mjs, in the folder that has `node_modules`.
import rosmsg from "@foxglove/rosmsg";
import serialization from "@foxglove/rosmsg2-serialization";
import protocol from "@foxglove/ws-protocol";
import { WebSocket } from "ws";

const { FoxgloveClient } = protocol;
const { MessageReader, MessageWriter } = serialization;

const ws = new WebSocket(process.argv[2], [FoxgloveClient.SUPPORTED_SUBPROTOCOL]);
const client = new FoxgloveClient({ ws });
const definition = (schema) => rosmsg.parse(schema, { ros2: true });
const print = (what, value) => console.log(JSON.stringify({ what, value }, exact));
const exact = (_, value) => (typeof value === "bigint" ? String(value) : ArrayBuffer.isView(value) ? [...value] : value);

// Returns the next event that fits; events are kept, so that none is missed.
const seen = new Map();
const waiting = [];
for (const name of [
  "serverInfo", "status", "message", "time", "advertise", "unadvertise", "advertiseServices", "parameterValues",
  "serviceCallResponse", "connectionGraphUpdate", "fetchAssetResponse", "error",
]) {
  client.on(name, (event) => {
    seen.set(name, [...(seen.get(name) ?? []), event]);
    for (const check of [...waiting]) check();
  });
}
function next(name, fits = () => true) {
  return new Promise((resolve) => {
    const check = () => {
      const found = (seen.get(name) ?? []).find(fits);
      if (found === undefined) return;
      waiting.splice(waiting.indexOf(check), 1);
      seen.set(name, seen.get(name).filter((each) => each !== found));
      resolve(found);
    };
    waiting.push(check);
    check();
  });
}
const known = { advertise: new Map(), advertiseServices: new Map() };
client.on("advertise", (found) => found.forEach((each) => known.advertise.set(each.topic, each)));
client.on("advertiseServices", (found) => found.forEach((each) => known.advertiseServices.set(each.name, each)));
async function entry(kind, name) {
  while (!known[kind].has(name)) await next(kind);
  return known[kind].get(name);
}
async function read(topic) {
  const channel = await entry("advertise", topic);
  const number = client.subscribe(channel.id);
  const message = await next("message", (each) => each.subscriptionId === number);
  client.unsubscribe(number);
  return new MessageReader(definition(channel.schema)).readMessage(message.data);
}

print("info", await next("serverInfo"));
print("map", await read("/map"));

const service = await entry("advertiseServices", "/add");
const request = new MessageWriter(definition(service.request.schema)).writeMessage({ a: 2n, b: 40n });
client.sendServiceCallRequest({ serviceId: service.id, callId: 1, encoding: "cdr", data: request });
const response = await next("serviceCallResponse");
print("sum", new MessageReader(definition(service.response.schema)).readMessage(response.data));

// A node answers each message on another topic, latched.
const json = client.advertise({ topic: "/json", encoding: "json", schemaName: "std_msgs/String" });
client.sendMessage(json, new TextEncoder().encode('{"data":"as json"}'));
print("json", await read("/json_echo"));
const channel = await entry("advertise", "/cdr");
const cdr = client.advertise({ topic: "/cdr", encoding: "cdr", schemaName: channel.schemaName });
client.sendMessage(cdr, new MessageWriter(definition(channel.schema)).writeMessage({ data: "as cdr" }));
print("cdr", await read("/cdr_echo"));

client.subscribeParameterUpdates(["/robot.speed"]);
client.getParameters(["/robot.speed", "/robot.name"], "get");
print("parameters", (await next("parameterValues", (each) => each.id === "get")).parameters);
client.setParameters([{ name: "/robot.speed", value: 3, type: "float64" }], "set");
print("set", (await next("parameterValues", (each) => each.id === "set")).parameters);
print("changed", (await next("parameterValues", (each) => each.id === undefined)).parameters);

client.subscribeConnectionGraph();
print("graph", await next("connectionGraphUpdate"));
client.fetchAsset("package://robot/shape.stl", 7);
const asset = await next("fetchAssetResponse");
print("asset", { ...asset, data: new TextDecoder().decode(asset.data) });
client.subscribe(4_000_000_000);
print("status", await next("status"));
print("errors", (seen.get("error") ?? []).map(String));
client.close();
