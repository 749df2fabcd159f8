// Reads the file of run --mcap by programs that are not ours: node read_mcap.mjs FILE.mcap COVARIANCES.csv
//
// The environment variable WITNESS_MODULES names the folder in which the packages of package.json are installed. Ends with an error
// unless every message can be decoded by the schema that the file has for it, nothing warns, and the covariances of the poses are
// those of the csv, which has nine digits, in the order and the axes of ROS.
import { createRequire } from "node:module";
import { readFileSync } from "node:fs";

const require = createRequire(process.env.WITNESS_MODULES + "/");
const { McapIndexedReader, McapStreamReader } = require("@mcap/core");
const { parse } = require("@foxglove/rosmsg");
const { MessageReader } = require("@foxglove/rosmsg2-serialization");
const zstd = require("@foxglove/wasm-zstd");
await zstd.isLoaded;

const expect = (holds, what) => { if (!holds) throw new Error(what); };
for (const level of ["warn", "error"]) console[level] = (...text) => { throw new Error(`${level}: ${text.join(" ")}`); };
process.on("warning", (warning) => { throw warning; });

const [file, table] = process.argv.slice(2);
const bytes = readFileSync(file);
const decompressHandlers = { zstd: (data, size) => zstd.decompress(data, Number(size)) };

/** Calls take(topic, message) for every message, in the order of the file, as a reader without seeking does. */
function readStream(take) {
  const reader = new McapStreamReader({ decompressHandlers, validateCrcs: true });
  reader.append(bytes);
  const schemas = new Map(), channels = new Map(), decoders = new Map(), kinds = new Set();
  for (let record; (record = reader.nextRecord()) !== undefined;) {
    kinds.add(record.type);
    if (record.type === "Schema") schemas.set(record.id, record);
    if (record.type === "Channel") channels.set(record.id, record);
    if (record.type !== "Message") continue;
    const channel = channels.get(record.channelId);
    expect(channel.messageEncoding === "cdr", "the messages are CDR");
    if (!decoders.has(channel.id)) {
      const schema = schemas.get(channel.schemaId);
      expect(schema.encoding === "ros2msg", "the schemas are ros2msg");
      decoders.set(channel.id, new MessageReader(parse(new TextDecoder().decode(schema.data), { ros2: true })));
    }
    take(channel.topic, decoders.get(channel.id).readMessage(record.data));
  }
  expect(reader.done(), "the file is whole");
  for (const kind of ["ChunkIndex", "MessageIndex", "Statistics", "SummaryOffset", "DataEnd"]) expect(kinds.has(kind), `no ${kind}`);
}

/** The numbers of messages by topic, as a reader that seeks finds them. */
async function countByIndex() {
  const readable = {
    size: async () => BigInt(bytes.length),
    read: async (offset, length) => new Uint8Array(bytes.buffer, bytes.byteOffset + Number(offset), Number(length)),
  };
  const reader = await McapIndexedReader.Initialize({ readable, decompressHandlers });
  expect(reader.header.profile === "ros2" && reader.header.library.startsWith("stereo_slam "), "the header");
  const counts = {};
  for await (const message of reader.readMessages({ validateCrcs: true })) {
    const topic = reader.channelsById.get(message.channelId).topic;
    counts[topic] = (counts[topic] ?? 0) + 1;
  }
  for (const [id, count] of reader.statistics.channelMessageCounts)
    expect(counts[reader.channelsById.get(id).topic] === Number(count), `the statistics of channel ${id}`);
  return counts;
}

const product = (A, B) => A.map((row) => B[0].map((_, j) => row.reduce((sum, a, k) => sum + a * B[k][j], 0)));
const transposed = (A) => A[0].map((_, j) => A.map((row) => row[j]));
function rotation({ x, y, z, w }) {
  return [[1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
          [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
          [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)]];
}
/** Columns 2 to 22 of a row of covariances.csv: the upper triangle of the covariance, rotation first, in the camera's axes. */
function covarianceOf(row) {
  const numbers = row.split(",").slice(2, 23).map(Number), P = [...Array(6)].map(() => Array(6));
  for (let i = 0, k = 0; i < 6; ++i) for (let j = i; j < 6; ++j) P[i][j] = P[j][i] = numbers[k++];
  return P;
}
/** The covariance of ROS, row by row: position first, along the parent's axes. */
function rosCovariance(P, R) {
  const A = [...Array(6)].map((_, i) => [...Array(6)].map((_, j) => ((i < 3) === (j < 3) ? 0 : R[i % 3][j % 3])));
  return product(product(A, P), transposed(A)).flat();
}

const messages = {};
readStream((topic, message) => { (messages[topic] ??= []).push(message); });
const counts = await countByIndex();
for (const topic of Object.keys(messages)) expect(counts[topic] === messages[topic].length, `the index of ${topic}`);

const rows = readFileSync(table, "utf8").trim().split("\n").slice(1);
const LINK_OPTICAL = [[0, 0, 1], [-1, 0, 0], [0, -1, 0]];  // x right, y down, z forward in x forward, y left, z up
const odometry = messages["/stereo_slam/odometry"], poses = messages["/stereo_slam/pose"];
expect(rows.length > 0 && odometry.length === rows.length && poses.length === rows.length, "a message a frame");
expect(messages["/tf"].length === rows.length && messages["/diagnostics"].length === rows.length, "a message a frame");
let largest = 0;
rows.forEach((row, i) => {
  const seconds = Number(row.split(",")[0]), stamp = odometry[i].header.stamp;
  expect(Math.abs(stamp.sec + 1e-9 * stamp.nanosec - seconds) < 1e-8, `the stamp of frame ${i}`);
  expect(messages["/diagnostics"][i].status[0].message.startsWith(row.split(",")[1]), `the status of frame ${i}`);
  for (const message of [odometry[i], poses[i]]) {
    const expected = rosCovariance(covarianceOf(row), product(rotation(message.pose.pose.orientation), LINK_OPTICAL));
    const scale = Math.max(...expected.map(Math.abs));
    expected.forEach((value, k) => { largest = Math.max(largest, Math.abs(message.pose.covariance[k] - value) / scale); });
  }
});
expect(largest < 1e-8, `covariances differ by ${largest}`);
expect(odometry.at(-1).header.frame_id === "odom" && odometry.at(-1).child_frame_id === "camera_link", "the frames of the odometry");
expect(odometry.at(-1).pose.pose.position.x > 1, "the camera drives forward along x");
expect(messages["/tf_static"][0].transforms[0].child_frame_id === "camera_optical_frame", "the optical frame");
const map = messages["/stereo_slam/map"].at(-1);
expect(map.data.length === 12 * map.width && map.width > 100, "the points of the map");
expect(messages["/stereo_slam/path"].at(-1).poses.length > 1, "the path");
const image = messages["/stereo_slam/left/compressed"][0];
expect(image.format === "jpeg" && image.data[0] === 0xff && image.data[1] === 0xd8, "the images");
console.log(`${rows.length} frames; the covariances agree to ${largest.toExponential(1)} of the largest entry`);
