// The link of the phone to the studio (docs/protocol.md): hello, clock exchange, frames, status, and reconnecting.
import { Keeper } from "./keeper.js";
import { pack, unpack } from "./msgpack.js";

const QUEUE = 60; // frames that wait while the link is down or slow; the oldest is dropped first
const SLOW_BYTES = 1 << 18; // of the browser's buffer: more than that waits here instead
const FIRST_DELAY_MS = 250, LONGEST_DELAY_MS = 5000, NAME_TAKEN_MS = 7000;
const BURST = 8, BURST_GAP_MS = 20, CLOCK_GAP_MS = 1000, STATUS_GAP_MS = 1000;
const LATE_BATCH = 10, LATE_PAUSE_MS = 20;
const SILENT_MS = 8000; // the server answers every second: a link without answers is dead, though nobody closed it

/** The phone's clock [ns], a whole number. */
export const nowNs = () => Math.round(performance.now() * 1e6);

export class Link {
  /** `status()` returns the content of a status message; `changed(state, detail)` gets "connecting", "open", "gone" or "refused". */
  constructor({ url, hello, spool, status, changed }) {
    Object.assign(this, { url, hello, status, changed });
    this.keeper = new Keeper(spool, hello);
    this.queue = [];
    this.socket = null;
    this.welcomed = false;
    this.framesSent = 0;
    this.framesDropped = 0;
    this.delay = FIRST_DELAY_MS;
    this.timers = [];
    this.pumping = null;
    this.ended = false;
    this.begun = performance.now();
  }

  /** Connect now, even if a later retry is scheduled. */
  connect() {
    clearTimeout(this.retry);
    if (this.ended || this.socket) return;
    this.changed("connecting");
    const socket = new WebSocket(this.url);
    socket.binaryType = "arraybuffer";
    this.socket = socket;
    this.heard = performance.now();
    socket.addEventListener("open", () => this.#send(this.hello));
    socket.addEventListener("message", ({ data }) => this.#hear(unpack(new Uint8Array(data))));
    socket.addEventListener("close", () => this.#lost(socket));
    this.timers = [setInterval(() => this.#watch(), 1000)];
  }

  /** End the link for good. */
  close() {
    this.ended = true;
    clearTimeout(this.retry);
    this.socket?.close(1000);
  }

  #watch() {
    if (performance.now() - this.heard <= SILENT_MS) return;
    const dead = this.socket;
    dead?.close();
    this.#lost(dead);
  }

  #lost(socket) {
    if (socket !== this.socket) return;
    this.socket = null;
    this.welcomed = false;
    for (const timer of this.timers) clearInterval(timer);
    if (this.ended) return;
    this.changed("gone");
    this.retry = setTimeout(() => this.connect(), this.delay);
    this.delay = Math.min(2 * this.delay, LONGEST_DELAY_MS);
  }

  #send(message) {
    if (this.socket?.readyState === WebSocket.OPEN) this.socket.send(pack(message));
  }

  #hear(message) {
    this.heard = performance.now();
    if (message.type === "welcome") this.#welcome();
    else if (message.type === "clock_reply") this.#send({ ...message, type: "clock_sample", client_receive_ns: nowNs() });
    else if (message.type === "recording") this.#say(this.keeper.recordingChanged(message));
    else if (message.type === "ack") this.#say(this.keeper.acknowledged(message));
    else if (message.type === "refused") this.#refused(message);
    this.#pump();
  }

  #say(messages) {
    for (const message of messages) this.#send(message);
    if (messages.length) this.sendStatus();
  }

  #refused({ code, reason }) {
    if (code === "name_taken" && performance.now() - this.begun < NAME_TAKEN_MS) return; // its last link is not yet noticed as lost
    this.close();
    this.changed("refused", { code, reason });
  }

  #welcome() {
    this.delay = FIRST_DELAY_MS;
    this.welcomed = true;
    this.changed("open");
    this.#say(this.keeper.connected());
    const ask = () => this.#send({ type: "clock_request", client_send_ns: nowNs() });
    for (let i = 0; i < BURST; i += 1) setTimeout(ask, i * BURST_GAP_MS);
    this.timers.push(setInterval(ask, CLOCK_GAP_MS), setInterval(() => this.sendStatus(), STATUS_GAP_MS));
    this.sendStatus();
  }

  /** Send this camera's status to the server at once. */
  sendStatus() {
    if (!this.welcomed) return;
    const { spool } = this.keeper;
    this.#send({
      type: "status", frames_sent: this.framesSent, frames_dropped: this.framesDropped, frames_kept: spool.owed,
      frames_not_kept: spool.refused, frames_unknown: spool.unknown, ...this.status(),
    });
  }

  /** Send a packed frame, or queue it until it can be sent. */
  frame(sequence, data) {
    this.keeper.frame(sequence, data);
    this.queue.push([sequence, data]);
    if (this.queue.length > QUEUE) {
      this.keeper.dropped(this.queue.shift()[0]);
      this.framesDropped += 1;
    }
    this.#pump();
  }

  #pump() {
    clearTimeout(this.pumping);
    if (!this.welcomed || this.socket.readyState !== WebSocket.OPEN) return;
    while (this.queue.length && this.socket.bufferedAmount < SLOW_BYTES) {
      const [sequence, data] = this.queue.shift();
      this.socket.send(data);
      this.keeper.sent(sequence);
      this.framesSent += 1;
    }
    for (let i = 0; i < LATE_BATCH && !this.queue.length; i += 1) {
      const late = this.keeper.nextLate();
      if (!late) return;
      this.#send(late);
    }
    this.pumping = setTimeout(() => this.#pump(), LATE_PAUSE_MS);
  }
}
