// Sends recorded parts to the server by HTTP, between takes and at a fraction of the link's speed (docs/protocol.md, "Video").
import { ivfHead } from "./ivf.js";

const PIECE_BYTES = 256 << 10, RETRY_MS = 5000, REST = 3;
const AGAIN = ["wanted"], OVER = ["kept", "unwanted"];

const wait = (ms) => new Promise((resolve) => { setTimeout(resolve, ms); });
const hex = (bytes) => [...new Uint8Array(bytes)].map((one) => one.toString(16).padStart(2, "0")).join("");

export class VideoSender {
  /** `maySend(part)`: whether this part may be sent now; `changed()` is called when another part is on the server or not wanted,
   * and when the studio starts or stops asking for video (`asked`). */
  constructor(store, token, maySend, changed) {
    Object.assign(this, { store, maySend, changed, asked: false });
    this.headers = token ? { Authorization: `Bearer ${token}` } : {};
    this.busy = false;
    this.rest = null; // resolves when the next piece may be sent
    this.timer = setInterval(() => this.send(), RETRY_MS);
    this.send();
  }

  end() { clearInterval(this.timer); }

  /** Send every part that the server wants now. */
  async send() {
    if (this.busy) return;
    this.busy = true;
    try {
      await this.#hear();
      for (const part of [...this.store.parts.values()]) if (this.maySend(part)) await this.#part(part);
    } catch (error) {
      console.info(`videos are not sent yet: ${error.message}`);
    } finally {
      this.busy = false;
    }
  }

  /** Find out whether the studio asks all phones for video. */
  async #hear() {
    const { keep } = await this.#ask("GET", "", "application/json");
    if (keep === this.asked) return;
    this.asked = keep;
    this.changed();
  }

  async #part(part) {
    const { data, times_ns } = await this.store.read(part.id);
    const file = new Blob([ivfHead(part.fourcc, part.width, part.height), ...data]);
    if (!times_ns.length) return this.store.delete(part.id);
    const { take_id, name, boot_id, from_sequence } = part;
    const sha256 = hex(await crypto.subtle.digest("SHA-256", await file.arrayBuffer()));
    let answer = await this.#ask("POST", "", "application/json", JSON.stringify({ take_id, name, boot_id, from_sequence, size: file.size, sha256, ending: ".ivf", times_ns }));
    while (AGAIN.includes(answer.state)) {
      await this.rest;
      if (!this.maySend(part)) return;
      const { id, received } = answer, began = performance.now();
      answer = await this.#ask("PUT", `/${id}?at=${received}`, "application/octet-stream", file.slice(received, received + PIECE_BYTES));
      this.rest = wait(Math.min(REST * (performance.now() - began), RETRY_MS));
    }
    if (!OVER.includes(answer.state)) return;
    this.store.delete(part.id);
    this.changed();
  }

  async #ask(method, path, type, body) {
    const answer = await fetch(`api/v1/video${path}`, { method, body, headers: { ...this.headers, "Content-Type": type } });
    if (answer.status === 422) return { state: "unwanted" }; // it would be refused for ever, and the others behind it wait
    if (!answer.ok) throw new Error(`status ${answer.status}`);
    return answer.json();
  }
}
