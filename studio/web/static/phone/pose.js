// The landmarks of the nearest person in each picture. `lite` is tried first: where it is fast, `full` takes its place.
const SMALL = 640, LARGE = 1280; // pixels of the longer side: for a body alone larger pictures gain nothing, hands need them
const TRIED = 12, FIRST = 3; // images that are measured, and the first of them, which are slower
const FAST_MS = 20, BEARABLE_MS = 33;
const SIMD = new Uint8Array([0, 97, 115, 109, 1, 0, 0, 0, 1, 5, 1, 96, 0, 1, 123, 3, 2, 1, 0, 10, 10, 1, 8, 0, 65, 0, 253, 15, 253, 98, 11]);

/** Whether this browser can run the models: WebAssembly with SIMD, and WebGL 2 in a thread. */
export const canFind = () => typeof WebAssembly === "object" && WebAssembly.validate(SIMD)
  && typeof OffscreenCanvas === "function" && Boolean(new OffscreenCanvas(1, 1).getContext("webgl2"));

const median = (values) => [...values].sort((a, b) => a - b)[values.length >> 1];

/** The thread was ended before it answered. */
export class Ended extends Error {}

class Thread {
  constructor() {
    this.worker = new Worker(new URL("pose_worker.js", import.meta.url), { type: "module" });
    this.refuse = () => {};
  }

  ask(message, given = []) {
    return new Promise((resolve, reject) => {
      this.refuse = reject;
      this.worker.onmessage = ({ data }) => (data.kind === "failed" ? reject(new Error(data.reason)) : resolve(data));
      this.worker.onerror = (event) => { event.preventDefault(); reject(new Error(event.message || "the thread ended")); };
      this.worker.postMessage(message, given);
    });
  }

  end() {
    this.worker.terminate();
    this.refuse(new Ended("the thread was ended")); // who waits for its answer would wait for ever
  }
}

export class Pose {
  /** `changed()` is called when another model is in use. */
  constructor(changed) {
    this.changed = changed;
    this.thread = null;
    this.model = "";
    this.delegate = "";
    this.busyMs = 0; // in all
    this.lastMs = 0; // time of the last image
    this.times = [];
    this.wanted = "auto";
    this.hands = false;
    this.settled = false;
  }

  /** Load a model: `auto`, `lite` or `full`; with `hands` the hand model too. Rejects if it cannot run. */
  async load(wanted = "auto", hands = false) {
    Object.assign(this, { wanted, hands });
    this.settled = wanted !== "auto";
    await this.#use(wanted === "full" ? "full" : "lite");
  }

  async #use(model) {
    const thread = new Thread();
    const { delegate } = await thread.ask({ kind: "load", model, hands: this.hands });
    this.thread?.end();
    Object.assign(this, { thread, model, delegate, times: [] });
    this.changed();
  }

  /** Median time of an image [ms]; null before enough were measured. */
  get ms() { return this.times.length > FIRST ? median(this.times.slice(FIRST)) : null; }

  /** Return {landmarks, world, people, hands: {left, right}, width, height, picture}: landmarks in shares of the picture, null
   * without a person or hand; the size of the whole picture; the picture as it was analysed, which the caller closes.
   * Rejects with `Ended` if another model takes over, or all ends. */
  async find(video, at_ms) {
    const { videoWidth: width, videoHeight: height } = video;
    const scale = Math.min(1, (this.hands ? LARGE : SMALL) / Math.max(width, height));
    const picture = await createImageBitmap(video, { resizeWidth: Math.round(scale * width), resizeHeight: Math.round(scale * height), resizeQuality: "medium" });
    this.lastMs = Math.max(at_ms, this.lastMs + 1); // a busy browser may give two images one time, which the model refuses
    const { took_ms, ...found } = await this.thread.ask({ kind: "frame", picture, at_ms: this.lastMs }, [picture]);
    this.busyMs += took_ms;
    this.#measured(took_ms);
    return { ...found, width, height };
  }

  #measured(took_ms) {
    this.times.push(took_ms);
    if (this.times.length > FIRST + TRIED) this.times.splice(FIRST, 1);
    if (this.settled || this.times.length < FIRST + TRIED) return;
    this.settled = true;
    if (this.model === "lite" && this.ms < FAST_MS) this.#upgrade();
  }

  /** Switch to the better model, and back if it is too slow. */
  async #upgrade() {
    try {
      await this.#use("full");
    } catch (error) {
      console.info(`the full model does not run here: ${error.message}`);
      return;
    }
    const look = setInterval(async () => {
      if (this.times.length < FIRST + TRIED) return;
      clearInterval(look);
      if (this.wanted === "auto" && this.ms > BEARABLE_MS) await this.#use("lite");
    }, 500);
  }

  end() { this.thread?.end(); }
}
