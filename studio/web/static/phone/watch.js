// What the operator must know about this phone at once: one condition at a time, the worst first.
const ORDER = ["closed", "hidden", "interrupted", "no_space", "video_full", "video_codec", "video_database", "rotated", "lens", "moved", "exposure", "two_people", "dark", "slow"];
const PASSING_MS = 10_000;

export class Watch {
  /** `changed()` is called when the worst condition changes. */
  constructor(changed) {
    this.changed = changed;
    this.standing = new Map();
  }

  /** Set a condition. */
  begin(what, values = {}) { this.#change(() => this.standing.set(what, values)); }

  /** Clear a condition. */
  end(what) { this.#change(() => this.standing.delete(what)); }

  /** Set a condition with these values, or clear it. */
  set(what, holds, values = {}) { if (holds) this.begin(what, values); else this.end(what); }

  /** Report an event for some seconds. */
  pass(what, values = {}) {
    this.begin(what, values);
    clearTimeout(this[what]);
    this[what] = setTimeout(() => this.end(what), PASSING_MS);
  }

  /** Worst condition that is set, [what, values], or null. */
  get worst() {
    const what = ORDER.find((one) => this.standing.has(one));
    return what ? [what, this.standing.get(what)] : null;
  }

  #change(act) {
    const before = JSON.stringify(this.worst);
    act();
    if (JSON.stringify(this.worst) !== before) this.changed();
  }
}
