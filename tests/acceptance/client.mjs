// A camera client written from docs/protocol.md alone, with nothing but Node: node client.mjs HOST PORT NAME SECONDS
// It never sends every tenth frame of a recording as it comes, and brings it late, when the server says that it lacks it.
// A second into a recording it breaks its link without a word, once, and goes on over a new one a little later.
import { randomBytes, createHash } from "node:crypto";
import net from "node:net";

const [host, port, name, seconds] = process.argv.slice(2);
const JOINTS = 21;
const ENDED = 2n ** 62n;
const bootId = randomBytes(8).toString("hex");
const now = () => process.hrtime.bigint() + 1_000_000_000_000n;

// --- MessagePack, as much as the protocol needs

function head(short, limit, codes, length) {
  if (short !== null && length < limit) return Buffer.from([short | length]);
  const sizes = [[codes[0], 1, 0x100], [codes[1], 2, 0x10000], [codes[2], 4, 0x100000000]];
  const [code, bytes] = sizes.find(([kind, , max]) => kind !== null && length < max);
  const out = Buffer.alloc(1 + bytes);
  out[0] = code;
  out.writeUIntBE(length, 1, bytes);
  return out;
}

function pack(value) {
  if (value === null) return Buffer.from([0xc0]);
  if (typeof value === "boolean") return Buffer.from([value ? 0xc3 : 0xc2]);
  if (typeof value === "bigint" || Number.isInteger(value)) {
    const out = Buffer.alloc(9);
    out[0] = value < 0 ? 0xd3 : 0xcf;
    if (value < 0) out.writeBigInt64BE(BigInt(value), 1);
    else out.writeBigUInt64BE(BigInt(value), 1);
    return out;
  }
  if (typeof value === "number") {
    const out = Buffer.alloc(9);
    out[0] = 0xcb;
    out.writeDoubleBE(value, 1);
    return out;
  }
  if (typeof value === "string") {
    const text = Buffer.from(value);
    return Buffer.concat([head(0xa0, 32, [0xd9, 0xda, 0xdb], text.length), text]);
  }
  if (Buffer.isBuffer(value)) return Buffer.concat([head(null, 0, [0xc4, 0xc5, 0xc6], value.length), value]);
  if (Array.isArray(value)) return Buffer.concat([head(0x90, 16, [null, 0xdc, 0xdd], value.length), ...value.map(pack)]);
  const pairs = Object.entries(value);
  return Buffer.concat([head(0x80, 16, [null, 0xde, 0xdf], pairs.length), ...pairs.flatMap(([k, v]) => [pack(k), pack(v)])]);
}

function unpack(data) {
  let at = 0;
  const take = (count) => data.subarray(at, (at += count));
  const uint = (bytes) => (bytes === 8 ? take(8).readBigUInt64BE() : take(bytes).readUIntBE(0, bytes));
  const int = (bytes) => (bytes === 8 ? take(8).readBigInt64BE() : take(bytes).readIntBE(0, bytes));
  const many = (count, read) => Array.from({ length: count }, read);
  const map = (count) => Object.fromEntries(many(count, () => [value(), value()]));
  function value() {
    const code = take(1)[0];
    if (code < 0x80) return code;
    if (code < 0x90) return map(code & 0x0f);
    if (code < 0xa0) return many(code & 0x0f, value);
    if (code < 0xc0) return take(code & 0x1f).toString();
    if (code >= 0xe0) return code - 256;
    if (code === 0xc0) return null;
    if (code === 0xc2 || code === 0xc3) return code === 0xc3;
    if (code >= 0xc4 && code <= 0xc6) return take(uint(1 << (code - 0xc4)));
    if (code === 0xca) return take(4).readFloatBE();
    if (code === 0xcb) return take(8).readDoubleBE();
    if (code >= 0xcc && code <= 0xcf) return uint(1 << (code - 0xcc));
    if (code >= 0xd0 && code <= 0xd3) return int(1 << (code - 0xd0));
    if (code >= 0xd9 && code <= 0xdb) return take(uint(1 << (code - 0xd9))).toString();
    if (code === 0xdc || code === 0xdd) return many(uint(code === 0xdc ? 2 : 4), value);
    if (code === 0xde || code === 0xdf) return map(uint(code === 0xde ? 2 : 4));
    throw new Error(`MessagePack code ${code}`);
  }
  return value();
}

// --- WebSocket (RFC 6455): client frames are masked, server frames are whole

let socket = null;
let upgraded = false;

function sendFrame(opcode, data) {
  const mask = randomBytes(4);
  const length = data.length < 126 ? Buffer.from([0x80 | data.length]) : Buffer.from([0x80 | 126, data.length >> 8, data.length & 255]);
  socket.write(Buffer.concat([Buffer.from([0x80 | opcode]), length, mask, data.map((byte, i) => byte ^ mask[i % 4])]));
}

const send = (message) => sendFrame(2, pack(message));

function link() {
  const key = randomBytes(16).toString("base64");
  const accept = createHash("sha1").update(`${key}258EAFA5-E914-47DA-95CA-C5AB0DC85B11`).digest("base64");
  let buffered = Buffer.alloc(0);
  upgraded = false;
  socket = net.connect(Number(port), host);
  socket.on("error", () => {});
  socket.on("close", () => {
    upgraded = false;
    if (done) process.exit(0);
    setTimeout(link, 700);
  });
  socket.on("data", (data) => { buffered = receive(Buffer.concat([buffered, data]), accept); });
  socket.write(`GET /api/v1/link HTTP/1.1\r\nHost: ${host}:${port}\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n`
    + `Sec-WebSocket-Key: ${key}\r\nSec-WebSocket-Version: 13\r\n\r\n`);
}

// Take in what has come; return what is left of it.
function receive(buffered, accept) {
  if (!upgraded) {
    const end = buffered.indexOf("\r\n\r\n");
    if (end < 0) return buffered;
    if (!buffered.subarray(0, end).toString().includes(accept)) throw new Error("no WebSocket");
    buffered = buffered.subarray(end + 4);
    upgraded = true;
    greet();
  }
  for (;;) {
    if (buffered.length < 2) return buffered;
    const small = buffered[1] & 0x7f;
    const [length, start] = small < 126 ? [small, 2] : small === 126 ? [buffered.length < 4 ? Infinity : buffered.readUInt16BE(2), 4]
      : [buffered.length < 10 ? Infinity : Number(buffered.readBigUInt64BE(2)), 10];
    if (buffered.length < start + length) return buffered;
    const [opcode, content] = [buffered[0] & 0x0f, buffered.subarray(start, start + length)];
    buffered = buffered.subarray(start + length);
    if (opcode === 9) sendFrame(10, content);
    else if (opcode === 2) hear(unpack(content));
  }
}

// --- the camera

const kept = new Map(); // sequence -> the bytes of its message
let sequence = 0;
let recording = null; // {take_id, first}
let late = 0;
let links = 0;
let done = false;

function greet() {
  send({ type: "hello", protocol_version: 1, name, device: "Node", joint_set: "canonical", boot_id: bootId });
}

function hear(message) {
  if (message.type === "welcome") {
    links += 1;
    for (let i = 0; i < 4; i += 1) setTimeout(() => send({ type: "clock_request", client_send_ns: now() }), 20 * i);
    if (kept.size) offer(recording.take_id); // after a lost link
    if (links === 1) {
      setInterval(sendSkeleton, 1000 / 30);
      setInterval(sendStatus, 1000);
      setTimeout(end, 1000 * Number(seconds));
    }
  } else if (message.type === "refused") {
    throw new Error(message.reason);
  } else if (message.type === "clock_reply") {
    const { client_send_ns, server_receive_ns, server_send_ns } = message;
    send({ type: "clock_sample", client_send_ns, server_receive_ns, server_send_ns, client_receive_ns: now() });
  } else if (message.type === "recording" && message.active) {
    if (recording?.take_id === message.take_id) return;
    if (links === 1) setTimeout(() => socket.destroy(), 1000);
    recording = { take_id: message.take_id };
    send({ type: "kept", take_id: recording.take_id, boot_id: bootId, first: sequence, last: sequence - 1 });
  } else if (message.type === "recording") {
    recording = null;
  } else if (message.type === "ack") {
    acknowledge(message);
  }
}

function acknowledge({ take_id, up_to, missing = [] }) {
  const lacking = (number) => missing.some(([begin, end]) => number >= begin && number <= end);
  for (const number of [...kept.keys()]) if (number <= up_to && !lacking(number)) kept.delete(number);
  const wanted = [...kept.keys()].filter(lacking);
  if (BigInt(up_to) === ENDED && kept.size) offer(take_id); // the take has ended: offer what it lacks
  for (const number of wanted) {
    send({ type: "late", take_id, boot_id: bootId, data: kept.get(number) });
    late += 1;
  }
}

function offer(take_id) {
  const numbers = [...kept.keys()];
  send({ type: "kept", take_id, boot_id: bootId, first: Math.min(...numbers), last: Math.max(...numbers) });
}

function sendStatus() {
  if (upgraded) send({ type: "status", frames_sent: sequence, frames_dropped: 0, message: "", frames_kept: kept.size });
}

function sendSkeleton() {
  const positions = new Float32Array(3 * JOINTS);
  for (let joint = 0; joint < JOINTS; joint += 1) positions.set([0.1 * joint - 1, 0.2, 3], 3 * joint);
  const confidence = new Float32Array(JOINTS).fill(0.9);
  const message = pack({
    type: "skeleton", sequence, device_time_ns: now(), positions: Buffer.from(positions.buffer), confidence: Buffer.from(confidence.buffer),
  });
  if (recording) kept.set(sequence, message);
  if (upgraded && (!recording || sequence % 10 !== 0)) sendFrame(2, message);
  sequence += 1;
}

function end() {
  console.log(JSON.stringify({ sent: sequence, late, links, kept: kept.size }));
  done = true;
  sendFrame(8, Buffer.from([0x03, 0xe8]));
  setTimeout(() => process.exit(0), 500);
}

link();
