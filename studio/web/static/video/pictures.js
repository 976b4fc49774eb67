// The pictures of a video: those that are needed next are fetched and decoded ahead of the playhead.
const AT_ONCE = 4; // requests under way
const DECODED_BYTES = 96e6; // of pictures kept ready to be drawn
const DECODED = [8, 120]; // so many at least and at most
const MOST_BYTES = 64e6; // of pictures kept as they came

export class Pictures {
  /** `address` returns a picture's URL by its number; `came` is called when one can be drawn, `failed` with its error. */
  constructor(address, came, failed) {
    Object.assign(this, { address, came, failed });
    this.blobs = new Map();
    this.bitmaps = new Map();
    this.broken = new Map(); // number -> why
    this.under = new Map(); // number -> what ends its request
    this.decoding = new Set();
    this.wanted = [];
    this.late = 0;
    this.bytes = 0;
    this.most = DECODED[0];
    this.latency_s = 0;
  }

  /** Return the decoded picture nearest to a number, at most `apart` from it: `[its number, picture]`, or null. */
  near(number, apart) {
    for (let by = 0; by <= apart; by += 1) {
      for (const one of [number - by, number + by]) if (this.bitmaps.has(one)) return [one, this.bitmaps.get(one)];
    }
    return null;
  }

  /** Request these pictures in order; the first `late` ones are used only if already fetched. */
  want(numbers, late) {
    Object.assign(this, { wanted: numbers, late });
    this.next();
  }

  close() {
    this.wanted = [];
    for (const end of this.under.values()) end.abort();
    for (const bitmap of this.bitmaps.values()) bitmap.close();
    this.bitmaps.clear();
    this.blobs.clear();
    this.came = this.failed = () => {};
  }

  next() {
    const soon = new Set(this.wanted.slice(0, Math.ceil(this.most / 2)));
    for (const number of soon) this.decode(number);
    for (const [number, bitmap] of this.bitmaps) {
      if (this.bitmaps.size <= this.most) break;
      if (soon.has(number)) continue;
      bitmap.close();
      this.bitmaps.delete(number);
    }
    for (const number of this.wanted.slice(this.late)) {
      if (this.under.size >= AT_ONCE) return;
      if (!this.blobs.has(number) && !this.under.has(number) && !this.broken.has(number)) this.fetch(number);
    }
  }

  async fetch(number) {
    const end = new AbortController(), began = performance.now();
    this.under.set(number, end);
    try {
      const response = await fetch(this.address(number), { signal: end.signal });
      if (response.ok) this.keep(number, await response.blob());
      else this.broken.set(number, (await response.json().catch(() => null))?.error ?? {});
      this.latency_s += 0.2 * ((performance.now() - began) / 1000 - this.latency_s);
    } catch (error) {
      if (error.name === "AbortError") return;
      this.broken.set(number, {});
    } finally {
      this.under.delete(number);
    }
    if (this.broken.has(number)) this.failed(number, this.broken.get(number));
    this.next();
  }

  keep(number, blob) {
    this.blobs.set(number, blob);
    this.bytes += blob.size;
    for (const [old, { size }] of this.blobs) {
      if (this.bytes <= MOST_BYTES) return;
      this.blobs.delete(old);
      this.bytes -= size;
    }
  }

  async decode(number) {
    if (this.bitmaps.has(number) || this.decoding.has(number) || !this.blobs.has(number)) return;
    this.decoding.add(number);
    const bitmap = await createImageBitmap(this.blobs.get(number)).catch(() => null);
    this.decoding.delete(number);
    if (!bitmap) {
      this.blobs.delete(number);
      this.broken.set(number, {});
      this.failed(number, {});
    } else {
      this.bitmaps.set(number, bitmap);
      this.most = Math.min(Math.max(Math.round(DECODED_BYTES / (4 * bitmap.width * bitmap.height)), DECODED[0]), DECODED[1]);
      this.came(number);
    }
  }
}
