// Records the pictures of a phone's camera during takes, with the browser's own encoder. Every picture keeps the time of its
// landmarks, so that both are in step without an offset.
import { ivfFrame } from "./ivf.js";

const PART_US = 20_000_000, PIECE_US = 1_000_000, KEY_US = 2_000_000;
const WAITING = 4; // pictures in the encoder: with more, pictures are left out of the video
const BITS = 0.09; // for a pixel of a picture
const CODECS = [
  { fourcc: "H264", codec: "avc1.42e028", avc: { format: "annexb" }, hardwareAcceleration: "prefer-hardware" },
  { fourcc: "VP80", codec: "vp8" },
];

async function codecFor(width, height, rate) {
  if (typeof VideoEncoder !== "function") return null;
  const usual = { width, height, framerate: rate, bitrate: Math.round(BITS * width * height * rate), latencyMode: "realtime" };
  for (const { fourcc, ...codec } of CODECS) {
    const config = { ...usual, ...codec };
    if ((await VideoEncoder.isConfigSupported(config).catch(() => null))?.supported) return { fourcc, config };
  }
  return null;
}

export class VideoRecorder {
  /** `changed(problem)` gets why nothing is recorded: "", "full" or "codec". */
  constructor(store, changed) {
    Object.assign(this, { store, changed });
    this.origin = null; // {take_id, name, boot_id, from_sequence} of what is recorded
    this.part = null;
    this.closing = null; // id of the part before, while the last of it is encoded
    this.encoder = null;
    this.busy = false;
    this.problem = "";
    this.leftOut = 0;
    this.count = 0;
  }

  /** Whether a part is still being recorded and must not be sent. */
  isOpen(id) { return id === this.part?.id || id === this.closing; }

  begin(origin) {
    if (this.origin?.take_id === origin.take_id) return;
    this.origin = origin;
    this.#say("");
  }

  /** End; resolves once what was recorded is in the store. */
  async end() {
    this.origin = null;
    await this.#close();
  }

  #say(problem) {
    this.problem = problem;
    this.changed(problem);
  }

  /** Record a picture: `source` as shown (null = it could not be had), of `width` x `height`; `time_ns`: of its capture; `rate`: pictures per second. */
  async picture(source, width, height, time_ns, rate) {
    if (!this.origin || this.problem || this.busy) return;
    const size = [width & ~1, height & ~1], since_us = this.part && this.part.first_ns !== null ? Math.round((time_ns - this.part.first_ns) / 1000) : 0;
    if (!this.part || since_us >= PART_US || size.join() !== this.part.size.join()) {
      this.busy = true;
      try {
        await this.#next(size, rate);
      } finally {
        this.busy = false;
      }
      return; // the next picture is its first: this one is closed meanwhile
    }
    if (this.encoder.encodeQueueSize >= WAITING) {
      this.leftOut += 1;
      return;
    }
    this.#encode(source, time_ns, since_us);
  }

  #encode(source, time_ns, since) {
    const { part } = this;
    part.first_ns ??= time_ns;
    if (since <= part.last_us) return;
    const [width, height] = part.size;
    let frame = null;
    try {
      frame = new VideoFrame(source, { timestamp: since, visibleRect: { x: 0, y: 0, width, height } });
    } catch {
      this.leftOut += 1; // the camera was interrupted just then
      return;
    }
    part.times.set(since, time_ns);
    const keyFrame = since - part.key_us >= KEY_US || part.last_us < 0;
    if (keyFrame) part.key_us = since;
    part.last_us = since;
    this.encoder.encode(frame, { keyFrame });
    frame.close();
  }

  /** Begin another part. */
  async #next(size, rate) {
    await this.#close();
    const { origin } = this;
    const found = await codecFor(...size, rate);
    if (!found) return this.#say("codec");
    if (!await this.store.hasRoom()) return this.#say("full");
    if (!origin || origin !== this.origin) return;
    this.count += 1;
    const part = {
      size, first_ns: null, last_us: -1, key_us: 0, times: new Map(), pieces: 0, waiting: [], waits_us: 0,
      id: `${origin.boot_id} ${String(this.count).padStart(6, "0")}`,
      kept: { ...origin, fourcc: found.fourcc, width: size[0], height: size[1], at: Date.now(), bytes: 0 },
    };
    part.kept.id = part.id;
    this.encoder = new VideoEncoder({ output: (chunk) => this.#encoded(part, chunk), error: () => this.#say("codec") });
    this.encoder.configure(found.config);
    this.part = part;
  }

  #encoded(part, chunk) {
    const since = chunk.timestamp, time_ns = part.times.get(since);
    part.times.delete(since);
    part.waiting.push([ivfFrame(chunk, since), time_ns]);
    if (since - part.waits_us >= PIECE_US) this.#write(part, since);
  }

  #write(part, upTo_us) {
    if (!part.waiting.length) return;
    const all = part.waiting.map(([data]) => data), data = new Uint8Array(all.reduce((sum, { length }) => sum + length, 0));
    let at = 0;
    for (const one of all) {
      data.set(one, at);
      at += one.length;
    }
    this.store.append(part.kept, part.pieces, data, part.waiting.map(([, time_ns]) => time_ns));
    Object.assign(part, { pieces: part.pieces + 1, waiting: [], waits_us: upTo_us });
  }

  async #close() {
    const { part, encoder } = this;
    if (!part) return;
    this.part = null; // what comes meanwhile is of another part
    this.closing = part.id;
    await encoder.flush().catch(() => null);
    if (encoder.state !== "closed") encoder.close();
    this.#write(part, part.last_us);
    if (this.closing === part.id) this.closing = null;
  }

  /** Write what is encoded so far, as the page may be closed next. */
  write() { if (this.part) this.#write(this.part, this.part.last_us); }
}
