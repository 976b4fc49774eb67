// How the phone is held, from its gravity sensor: slanted, lying flat, in a hand, or moved after it stood still.
const G = 9.81;
const SMOOTH = 0.1; // of a new reading
const STILL_DEG = 0.7, MOVED_DEG = 2, FLAT = 0.75;
const SETTLED_MS = 2000;

const angle = (a, b) => (180 / Math.PI) * Math.acos(Math.min(1, Math.max(-1, (a[0] * b[0] + a[1] * b[1] + a[2] * b[2]) / (Math.hypot(...a) * Math.hypot(...b)))));

export class Held {
  /** `moved(degrees)` is called when the phone was turned after standing still. */
  constructor(moved) {
    this.moved = moved;
    this.gravity = null;
    this.rest = null; // where gravity pointed when it came to rest
    this.stillSince = 0;
    this.hear = (event) => this.#hear(event.accelerationIncludingGravity);
  }

  /** Start listening; some phones ask for permission first, which needs a touch. */
  async start() {
    if (typeof DeviceMotionEvent === "undefined") return;
    const allowed = await DeviceMotionEvent.requestPermission?.().catch(() => "denied");
    if (allowed === undefined || allowed === "granted") addEventListener("devicemotion", this.hear);
  }

  end() { removeEventListener("devicemotion", this.hear); }

  #hear(reading) {
    if (reading?.x === null || reading?.x === undefined) return;
    const now = [reading.x, reading.y, reading.z];
    this.gravity = this.gravity?.map((one, i) => one + SMOOTH * (now[i] - one)) ?? now;
    const time = performance.now();
    if (angle(now, this.gravity) > STILL_DEG || Math.abs(Math.hypot(...now) - G) > 0.5) this.stillSince = time;
    if (this.rest && angle(this.gravity, this.rest) > MOVED_DEG) {
      this.moved(angle(this.gravity, this.rest));
      this.rest = null;
      this.stillSince = time;
    }
    if (!this.rest && time - this.stillSince > SETTLED_MS) this.rest = this.gravity;
  }

  /** Return {slanted_deg, flat, moving}; null where the phone does not report it. */
  get now() {
    if (!this.gravity) return null;
    const [x, y, z] = this.gravity;
    const turn = Math.abs((180 / Math.PI) * Math.atan2(x, y)) % 90;
    return { slanted_deg: Math.min(turn, 90 - turn), flat: Math.abs(z) > FLAT * G, moving: !this.rest };
  }
}
