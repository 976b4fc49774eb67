// What the operator is to know of this phone at once: one thing at a time, the worst first.
const ORDER = ["closed", "hidden", "interrupted", "no_space", "video_full", "video_codec", "video_database", "rotated", "lens", "moved", "exposure", "two_people", "dark", "slow"];
const PASSING_MS = 10_000;

export class Watch {
  /** `changed()`: another thing is the worst now. */
  constructor(changed) {
    this.changed = changed;
    this.standing = new Map();
  }

  /** Something holds from now on. */
  begin(what, values = {}) { this.#change(() => this.standing.set(what, values)); }

  /** It holds no longer. */
  end(what) { this.#change(() => this.standing.delete(what)); }

  /** It holds now, with these values, or not. */
  set(what, holds, values = {}) { if (holds) this.begin(what, values); else this.end(what); }

  /** It happened: told for some seconds. */
  pass(what, values = {}) {
    this.begin(what, values);
    clearTimeout(this[what]);
    this[what] = setTimeout(() => this.end(what), PASSING_MS);
  }

  /** The worst that holds, [what, values], or null. */
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
