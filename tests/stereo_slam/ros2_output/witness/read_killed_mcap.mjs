// Reads what a killed run left of its file of --mcap, by programs that are not ours: node read_killed_mcap.mjs FILE.mcap
//
// WITNESS_MODULES as for read_mcap.mjs. The file is read as a stream up to the last complete chunk. Ends with an error unless every message there can
// be decoded and the frames are complete; prints how many there are.
import { createRequire } from "node:module";
import { readFileSync } from "node:fs";

const require = createRequire(process.env.WITNESS_MODULES + "/");
const { McapStreamReader } = require("@mcap/core");
const { parse } = require("@foxglove/rosmsg");
const { MessageReader } = require("@foxglove/rosmsg2-serialization");
const zstd = require("@foxglove/wasm-zstd");
await zstd.isLoaded;

const decompressHandlers = { zstd: (data, size) => zstd.decompress(data, Number(size)) };
const reader = new McapStreamReader({ decompressHandlers, validateCrcs: true });
reader.append(readFileSync(process.argv[2]));
const schemas = new Map(), topics = new Map(), decoders = new Map(), counts = {};
let last = -1;
for (let record; (record = reader.nextRecord()) !== undefined;) {
  if (record.type === "Schema") schemas.set(record.id, parse(new TextDecoder().decode(record.data), { ros2: true }));
  if (record.type === "Channel") {
    topics.set(record.id, record.topic);
    decoders.set(record.id, new MessageReader(schemas.get(record.schemaId)));
  }
  if (record.type !== "Message") continue;
  const topic = topics.get(record.channelId), message = decoders.get(record.channelId).readMessage(record.data);
  counts[topic] = (counts[topic] ?? 0) + 1;
  if (topic !== "/stereo_slam/odometry") continue;
  const stamp = message.header.stamp.sec + 1e-9 * message.header.stamp.nanosec;
  if (stamp <= last) throw new Error(`the stamp ${stamp} does not increase`);
  last = stamp;
}
const frames = counts["/stereo_slam/odometry"] ?? 0;
for (const topic of ["/stereo_slam/pose", "/tf", "/diagnostics", "/stereo_slam/left/compressed"])
  if ((counts[topic] ?? 0) !== frames) throw new Error(`${counts[topic]} messages on ${topic}, but ${frames} frames`);
console.log(frames);
