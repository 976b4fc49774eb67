// The video of this phone's camera: recorded during takes if wanted, stored, and sent to the studio between takes.
import { VideoRecorder } from "./recorder.js";
import { VideoSender } from "./sender.js";
import { VideoStore } from "./store.js";

export class Footage {
  /** `changed(problem)` gets why nothing is recorded ("": no problem); it is also called after every part that was sent. */
  constructor(link, token, changed) {
    this.link = link;
    this.changed = changed;
    this.store = new VideoStore(() => this.#fail("full"));
    this.recorder = new VideoRecorder(this.store, changed);
    this.sender = null;
    this.token = token;
    this.flipped = null;
  }

  /** Read what earlier starts of the page left, and begin to send it. */
  async open() {
    try {
      await this.store.open();
    } catch {
      return this.#fail("database");
    }
    this.sender = new VideoSender(this.store, this.token, (part) => this.#maySend(part), () => this.changed(this.recorder.problem));
  }

  /** Whether the studio asks all phones for video. */
  get asked() { return this.sender?.asked ?? false; }

  /** Number of parts that the studio does not have yet. */
  get owed() { return this.store.parts.size; }

  #fail(problem) {
    this.recorder.problem = problem;
    this.changed(problem);
  }

  #maySend({ id }) { return this.link.welcomed && !this.link.keeper.recording && !this.recorder.isOpen(id); }

  /** Handle a picture of `width` x `height` (null = it could not be had), captured at `time_ns`: during a take it is recorded if
   * `wanted` or `asked`. `sequence`: number of the next frame of landmarks; `mirrored`: it is mirrored back, as the landmarks are. */
  frame(picture, time_ns, { wanted, sequence, mirrored, rate, width, height }) {
    const { active, hello } = this.link.keeper;
    if (!this.store.database || !(wanted || this.asked) || !active) {
      if (this.recorder.origin) this.recorder.end().then(() => this.sender?.send());
      return;
    }
    this.recorder.begin({ take_id: active, name: hello.name, boot_id: hello.boot_id, from_sequence: sequence });
    this.recorder.picture(mirrored && picture ? this.#turned(picture, width, height) : picture, width, height, time_ns, rate);
  }

  #turned(picture, width, height) {
    const { flipped } = this;
    if (flipped?.width !== width || flipped.height !== height) this.flipped = new OffscreenCanvas(width, height);
    const pen = this.flipped.getContext("2d");
    pen.setTransform(-1, 0, 0, 1, width, 0);
    pen.drawImage(picture, 0, 0);
    return this.flipped;
  }

  /** Write what is recorded so far, as the page may be closed next. */
  write() { this.recorder.write(); }

  end() {
    this.recorder.end();
    this.sender?.end();
  }
}
