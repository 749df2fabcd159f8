// Writes the MCAP files of this folder with programs that are not ours: node write_mcap.mjs [FOLDER]
//
//   npm install @mcap/core@2.2.2 @foxglove/rosmsg2-serialization@3.1.0 @foxglove/rosmsg-serialization@2.0.4 \
//     @foxglove/rosmsg@5.0.5 @foxglove/rosmsg-msgs-common@3.2.3 @foxglove/wasm-zstd@1.0.1
//
// and the program lz4, where node finds them. Every file holds the drive that witness_bags_test.cpp describes.
import { McapWriter } from "@mcap/core";
import { MessageWriter as Ros2Writer } from "@foxglove/rosmsg2-serialization";
import { MessageWriter as Ros1Writer } from "@foxglove/rosmsg-serialization";
import common from "@foxglove/rosmsg-msgs-common";
import zstd from "@foxglove/wasm-zstd";
import { execFileSync } from "node:child_process";
import { writeFileSync } from "node:fs";
import { deflateSync, crc32 } from "node:zlib";

const folder = process.argv[2] ?? ".";
const WIDTH = 32, HEIGHT = 16, FRAMES = 4;
const FIRST_NS = 1_700_000_000_000_000_000n;
await zstd.isLoaded;

/** Pixels of an image; side is 0 or 1. */
function pixels(side, frame) {
  const data = new Uint8Array(WIDTH * HEIGHT);
  for (let y = 0; y < HEIGHT; ++y) {
    for (let x = 0; x < WIDTH; ++x) data[WIDTH * y + x] = (3 * x + 5 * y + 17 * frame + 101 * side) % 256;
  }
  return data;
}

/** A grey PNG; crc32 of node:zlib is there from node 20.15 on. */
function png(side, frame) {
  const chunk = (kind, data) => {
    const body = Buffer.concat([Buffer.from(kind, "latin1"), data]);
    const ends = Buffer.alloc(8);
    ends.writeUInt32BE(data.length, 0);
    ends.writeUInt32BE(crc32(body), 4);
    return Buffer.concat([ends.subarray(0, 4), body, ends.subarray(4)]);
  };
  const header = Buffer.alloc(13);
  header.writeUInt32BE(WIDTH, 0);
  header.writeUInt32BE(HEIGHT, 4);
  header[8] = 8;
  const grey = pixels(side, frame);
  const rows = Buffer.alloc(HEIGHT * (WIDTH + 1));
  for (let y = 0; y < HEIGHT; ++y) rows.set(grey.subarray(WIDTH * y, WIDTH * (y + 1)), y * (WIDTH + 1) + 1);
  const signature = Buffer.from([0x89, 0x50, 0x4e, 0x47, 0x0d, 0x0a, 0x1a, 0x0a]);
  return Buffer.concat([signature, chunk("IHDR", header), chunk("IDAT", deflateSync(rows)), chunk("IEND", Buffer.alloc(0))]);
}

function header(ns, ros1) {
  const sec = Number(ns / 1_000_000_000n), nsec = Number(ns % 1_000_000_000n);
  return ros1 ? { seq: 7, stamp: { sec, nsec }, frame_id: "camera" } : { stamp: { sec, nanosec: nsec }, frame_id: "camera" };
}

function cameraInfo(side, ns, ros1) {
  const K = [40, 0, 16, 0, 40, 8, 0, 0, 1], R = [1, 0, 0, 0, 1, 0, 0, 0, 1];
  const P = [40, 0, 16, side === 0 ? 0 : -10, 0, 40, 8, 0, 0, 0, 1, 0], D = [0, 0, 0, 0, 0];
  const roi = { x_offset: 0, y_offset: 0, height: 0, width: 0, do_rectify: false };
  const common = { header: header(ns, ros1), height: HEIGHT, width: WIDTH, distortion_model: "plumb_bob", binning_x: 0, binning_y: 0, roi };
  return ros1 ? { ...common, D, K, R, P } : { ...common, d: D, k: K, r: R, p: P };
}

/** Writes the drive. `write` are options of McapWriter. */
async function write(name, { ros1 = false, compressed = false, reversed = false, ...options }) {
  const parts = [];
  const writable = {
    position: () => BigInt(parts.reduce((sum, part) => sum + part.length, 0)),
    write: async (part) => { parts.push(Buffer.from(part)); },
  };
  const writer = new McapWriter({ writable, chunkSize: 3000, ...options });
  await writer.start({ profile: ros1 ? "ros1" : "ros2", library: "witness" });
  const definitions = ros1 ? common.ros1 : common.ros2humble;
  const channels = new Map();
  const add = async (topic, type, message, ns) => {
    const full = ros1 ? `sensor_msgs/${type}` : `sensor_msgs/msg/${type}`;
    if (!channels.has(topic)) {
      const root = definitions[`sensor_msgs/${type}`];
      const ordered = [{ definitions: root.definitions }, ...Object.values(definitions)];
      const schemaId = await writer.registerSchema({ name: full, encoding: ros1 ? "ros1msg" : "ros2msg", data: Buffer.from("# " + full) });
      const id = await writer.registerChannel({ schemaId, topic, messageEncoding: ros1 ? "ros1" : "cdr", metadata: new Map() });
      channels.set(topic, { id, serializer: new (ros1 ? Ros1Writer : Ros2Writer)(ordered) });
    }
    const { id, serializer } = channels.get(topic);
    await writer.addMessage({ channelId: id, sequence: 0, logTime: ns, publishTime: ns, data: Buffer.from(serializer.writeMessage(message)) });
  };
  const frames = [...Array(FRAMES).keys()];
  for (const frame of reversed ? frames.reverse() : frames) {
    for (const side of [1, 0]) {
      const taken = FIRST_NS + 100_000_000n * BigInt(frame) + (side === 1 ? 200_000n : 0n);
      const recorded = taken + 30_000_000n;
      const camera = `/stereo/${side === 0 ? "left" : "right"}`;
      const data = compressed ? png(side, frame) : pixels(side, frame);
      const image = compressed
        ? { header: header(taken, ros1), format: "mono8; png compressed", data }
        : { header: header(taken, ros1), height: HEIGHT, width: WIDTH, encoding: "mono8", is_bigendian: 0, step: WIDTH, data };
      await add(`${camera}/image_rect${compressed ? "/compressed" : ""}`, compressed ? "CompressedImage" : "Image", image, recorded);
      await add(`${camera}/camera_info`, "CameraInfo", cameraInfo(side, taken, ros1), recorded);
    }
    const ns = FIRST_NS + 100_000_000n * BigInt(frame);
    const zero = { x: 0, y: 0, z: 0 }, nine = [0, 0, 0, 0, 0, 0, 0, 0, 0];
    await add("/imu", "Imu", { header: header(ns, ros1), orientation: { ...zero, w: 1 }, orientation_covariance: nine, angular_velocity: zero,
      angular_velocity_covariance: nine, linear_acceleration: { x: 0, y: 0, z: 9.81 }, linear_acceleration_covariance: nine }, ns);
  }
  await writer.end();
  writeFileSync(`${folder}/${name}.mcap`, Buffer.concat(parts));
}

const byZstd = (data) => ({ compression: "zstd", compressedData: zstd.compress(data) });
const byLz4 = (data) => ({ compression: "lz4", compressedData: execFileSync("lz4", ["-c", "-q"], { input: data }) });
const bare = { useStatistics: false, useSummaryOffsets: false, repeatSchemas: false, repeatChannels: false, useMessageIndex: false, useChunkIndex: false };
await write("none", {});
await write("lz4", { compressChunk: byLz4 });
await write("zstd", { compressChunk: byZstd });
await write("lz4_without_index", { compressChunk: byLz4, ...bare });
await write("zstd_without_index", { compressChunk: byZstd, ...bare });
await write("unchunked", { useChunks: false });
await write("no_message_index", { compressChunk: byZstd, useMessageIndex: false });
await write("no_statistics", { compressChunk: byZstd, useStatistics: false });
await write("reversed", { compressChunk: byZstd, reversed: true, chunkSize: 1 << 20 });
await write("ros1", { compressChunk: byLz4, ros1: true });
await write("png", { compressed: true, compressChunk: byZstd });
