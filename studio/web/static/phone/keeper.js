// Recording without loss: what a camera reports and resends so that every frame reaches the server's disk.
//
// The rules are in docs/protocol.md, "Nothing lost". Sequences are of this start of the page unless a key says otherwise.
import { keyOf } from "./spool.js";

const RECENT = 60; // frames kept before this camera hears of a take, since the take may have begun with them
const ENDED = 2n ** 62n;

export class Keeper {
  /** `hello`: of this start of the page. */
  constructor(spool, hello) {
    this.spool = spool;
    this.hello = hello;
    this.active = null; // the id of the take that frames are kept for
    this.confirmed = false; // the server has named the take on this connection
    this.answered = new Set();
    this.unsent = new Map(); // key -> Set of sequences
    this.newest = -1;
    this.recent = [];
  }

  get recording() { return this.active !== null; }

  /** Register a frame before it is sent. */
  frame(sequence, data) {
    this.newest = sequence;
    this.recent.push([sequence, data]);
    if (this.recent.length > RECENT) this.recent.shift();
    if (this.active) this.spool.append(this.active, this.hello.boot_id, this.hello, sequence, data);
  }

  /** Register a frame that a slow link dropped. */
  dropped(sequence) {
    if (!this.active) {
      this.recent = this.recent.filter(([one]) => one !== sequence);
      return;
    }
    const key = this.#own(this.active);
    if (!this.unsent.has(key)) this.unsent.set(key, new Set());
    this.unsent.get(key).add(sequence);
  }

  /** Register a frame that was sent. */
  sent(sequence) {
    for (const [key, waiting] of this.unsent) if (this.spool.origins.get(key)?.boot_id === this.hello.boot_id) waiting.delete(sequence);
  }

  #own(take_id) { return keyOf(take_id, this.hello.boot_id); }

  /** Handle a new connection: return the messages to send on it. */
  connected() {
    this.confirmed = false;
    this.recent = []; // the server does not have the frames that come now
    this.answered = new Set();
    this.unsent = new Map();
    const offers = [...this.spool.origins].filter(([, { hello }]) => hello.name === this.hello.name).flatMap(([key]) => this.#offer(key));
    if (this.active && !this.unsent.has(this.#own(this.active))) offers.push(this.#begin(this.active));
    return offers;
  }

  #begin(take_id) {
    this.answered.add(this.#own(take_id));
    let first = this.newest + 1;
    for (const [sequence, data] of this.recent) {
      if (this.spool.append(take_id, this.hello.boot_id, this.hello, sequence, data)) first = Math.min(first, sequence);
    }
    return { type: "kept", take_id, boot_id: this.hello.boot_id, first, last: this.newest };
  }

  /** Offer a take's kept frames; they are sent after the answer. */
  #offer(key) {
    const origin = this.spool.origins.get(key);
    const kept = [...(origin?.frames.keys() ?? [])].sort((a, b) => a - b);
    if (!kept.length) return [];
    this.unsent.set(key, new Set(kept));
    const { take_id, boot_id, hello } = origin;
    return [{ type: "kept", take_id, boot_id, first: kept[0], last: kept.at(-1), hello: boot_id === this.hello.boot_id ? null : hello }];
  }

  /** Handle whether the server records: return the messages to send. */
  recordingChanged({ active, take_id }) {
    const before = this.active, confirmed = this.confirmed, out = [];
    if (active && before === take_id) {
      this.confirmed = true;
      return out;
    }
    this.active = null;
    if (before && !confirmed) { // it ended while the link was down; else its last ack is on its way
      this.answered.delete(this.#own(before));
      out.push(...this.#offer(this.#own(before)));
    }
    if (active && take_id) {
      this.active = take_id;
      this.confirmed = true;
      if (!this.unsent.has(this.#own(take_id))) out.push(this.#begin(take_id));
    }
    return out;
  }

  /** Handle which frames are on the server's disk: return the messages to send. */
  acknowledged({ take_id, boot_id, up_to, missing = [], known = true }) {
    const key = keyOf(take_id, boot_id), origin = this.spool.origins.get(key);
    if (!known) {
      this.unsent.delete(key);
      if (origin) origin.unknown = true;
      return [];
    }
    if (origin) {
      origin.unknown = false;
      const gone = [...origin.frames.keys()].filter((one) => one <= up_to && !missing.some(([begin, end]) => begin <= one && one <= end));
      this.spool.drop(key, gone);
      for (const sequence of gone) this.unsent.get(key)?.delete(sequence);
    }
    if (BigInt(up_to) !== ENDED) {
      this.answered.add(key);
      return [];
    }
    this.answered.delete(key);
    if (origin && !origin.frames.size) this.spool.forget(key);
    return this.#offer(key);
  }

  /** Whether a kept frame should be sent now. */
  get hasLate() { return [...this.answered].some((key) => this.unsent.get(key)?.size); }

  /** Return the oldest kept frame to send again as a message, null if there is none. */
  nextLate() {
    for (const key of this.answered) {
      const waiting = this.unsent.get(key), origin = this.spool.origins.get(key);
      for (const sequence of waiting ?? []) {
        waiting.delete(sequence);
        const data = origin?.frames.get(sequence);
        if (data) return { type: "late", take_id: origin.take_id, boot_id: origin.boot_id, data };
      }
    }
    return null;
  }
}
