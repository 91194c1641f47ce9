// What roslib can do, against a server of rosbridge whose address is the last argument. Fails at the first surprise.
import assert from "node:assert/strict";
import * as ROSLIB from "roslib";

const ros = new ROSLIB.Ros({ url: process.argv.at(-1) });
const limit = setTimeout(() => { throw new Error("Not done within 60 s"); }, 60_000);
const statuses = [];
ros.on("status", (status) => statuses.push(status));
ros.on("error", (error) => { throw error; });
await new Promise((resolve) => ros.on("connection", resolve));

const done = (ask) => new Promise((resolve, reject) => ask(resolve, reject));
const until = async (fits, ask) => {
    for (;;) {
        const found = await done(ask);
        if (fits(found)) return found;
    }
};

// rosapi
await until((found) => found.includes("/fibonacci"), (ok, no) => ros.getActionServers(ok, no));
const topics = await done((ok, no) => ros.getTopics(ok, no));
assert.equal(topics.types[topics.topics.indexOf("/rosout")], "rcl_interfaces/msg/Log");
assert.ok((await done((ok, no) => ros.getNodes(ok, no))).includes("/fibonacci"));
assert.ok((await done((ok, no) => ros.getServices(ok, no))).includes("/fibonacci/get_parameters"));
assert.equal(await done((ok, no) => ros.getTopicType("/rosout", ok, no)), "rcl_interfaces/msg/Log");
const header = await done((ok, no) => ros.getMessageDetails("std_msgs/Header", ok, no));
assert.deepEqual(ros.decodeTypeDefs(header), { stamp: { sec: "int32", nanosec: "uint32" }, frame_id: "string" });
const raw = await done((ok, no) => ros.getTopicsAndRawTypes(ok, no));
assert.equal(raw.topics.length, raw.typedefs_full_text.length);

// Parameters
const speed = new ROSLIB.Param({ ros, name: "/fibonacci:speed" });
assert.equal(await done((ok, no) => speed.get(ok, no)), 1.5);
await done((ok, no) => speed.set(2, ok, no));
assert.equal(await done((ok, no) => speed.get(ok, no)), 2);

// Topics
for (const compression of ["none", "png", "cbor"]) {
    const options = { ros, name: `/scan_${compression}`, messageType: "sensor_msgs/LaserScan", compression };
    const [reader, writer] = [new ROSLIB.Topic(options), new ROSLIB.Topic(options)];
    const message = done((ok) => reader.subscribe(ok));
    writer.advertise();
    const timer = setInterval(() => writer.publish({ ranges: [1.5, 2], range_max: null }), 20);
    const found = await message;
    clearInterval(timer);
    assert.deepEqual([...found.ranges], [1.5, 2], compression);
    assert.ok(found.header.stamp.sec > 0);
    assert.ok(compression === "cbor" ? Number.isNaN(found.range_max) : found.range_max === null);
    reader.unsubscribe();
    writer.unadvertise();
}

// Services, both ways
const service = (name) => new ROSLIB.Service({ ros, name, serviceType: "std_srvs/SetBool" });
const server = service("/set");
server.advertise((request, response) => {
    Object.assign(response, { success: request.data, message: "done" });
    return true;
});
await until((found) => found.includes("/set"), (ok, no) => ros.getServices(ok, no));
const response = await done((ok, no) => service("/set").callService({ data: true }, ok, no));
assert.deepEqual(response, { success: true, message: "done" });
server.unadvertise();
const failure = await done((ok) => service("/nothing").callService({ data: true }, () => ok("answered"), ok));
assert.match(String(failure), /has no server/);

// Actions, both ways
const action = (name) => new ROSLIB.Action({ ros, name, actionType: "example_interfaces/action/Fibonacci" });
const feedback = [];
const result = await done((ok, no) => action("/fibonacci").sendGoal({ order: 3 }, ok, (each) => feedback.push(each), no));
assert.deepEqual(result.sequence, [0, 1, 1, 2]);
assert.equal(feedback.length, 2);
const mine = action("/mine");
mine.advertise(
    (goal, id) => { mine.sendFeedback(id, { sequence: [1] }); mine.setSucceeded(id, { sequence: [goal.order] }); },
    (id) => mine.setCanceled(id, { sequence: [] }),
);
await until((found) => found.includes("/mine"), (ok, no) => ros.getActionServers(ok, no));
assert.deepEqual((await done((ok, no) => action("/mine").sendGoal({ order: 4 }, ok, () => {}, no))).sequence, [4]);

// Status messages
ros.callOnConnection({ op: "advertise", topic: "/a", type: "std_msgs/Nothing" });
await done((ok, no) => ros.getNodes(ok, no));
assert.match(statuses[0].msg, /Nothing/);
assert.equal(statuses.length, 1);

clearTimeout(limit);
ros.close();
console.log("roslib: all of it works");
