// The frames of recordings that a phone keeps until the server has them on its disk: in memory, and in the browser's
// database, so that they survive closing the page. Frames belong to a take and to one start of the page (`boot_id`).
const DATABASE = "capture-studio", FRAMES = "frames", ORIGINS = "origins";
const WRITE_MS = 500;
const KEPT_MS = 30 * 24 * 3600 * 1000;

/** Key of a take and a start of the page. */
export const keyOf = (take_id, boot_id) => `${take_id} ${boot_id}`;

const done = (request) => new Promise((resolve, reject) => {
  request.onsuccess = () => resolve(request.result);
  request.onerror = () => reject(request.error);
});

async function openDatabase() {
  const request = indexedDB.open(DATABASE, 1);
  request.onupgradeneeded = () => {
    request.result.createObjectStore(FRAMES);
    request.result.createObjectStore(ORIGINS);
  };
  return done(request);
}

export class Spool {
  /** `most`: maximum of kept bytes; frames beyond are refused and counted. */
  constructor(most = 128 << 20) {
    this.most = most;
    this.bytes = 0;
    this.refused = 0;
    this.full = false;
    this.origins = new Map(); // key -> {take_id, boot_id, hello, at, frames: Map(sequence -> bytes), unknown}
    this.database = null;
    this.changes = []; // what the database does not have yet: [store, key, what is put there, or null]
    this.timer = null;
  }

  /** Read what earlier starts left; without a database (a private window) frames are kept in memory alone. */
  async open() {
    try {
      this.database = await openDatabase();
      const read = this.database.transaction([ORIGINS, FRAMES]);
      const [origins, keys, frames] = await Promise.all([
        done(read.objectStore(ORIGINS).getAll()), done(read.objectStore(FRAMES).getAllKeys()), done(read.objectStore(FRAMES).getAll())]);
      for (const origin of origins) this.origins.set(keyOf(origin.take_id, origin.boot_id), { ...origin, frames: new Map(), unknown: false });
      keys.forEach(([take_id, boot_id, sequence], i) => this.#hold(this.origins.get(keyOf(take_id, boot_id)), sequence, frames[i]));
      for (const [key, { frames: kept, at }] of this.origins) if (!kept.size || Date.now() - at > KEPT_MS) this.forget(key);
    } catch (error) {
      console.info(`frames are kept in memory alone: ${error}`);
    }
  }

  /** Number of kept frames that the server may need. */
  get owed() { return this.#count(false); }

  /** Number of kept frames of takes that the server does not know. */
  get unknown() { return this.#count(true); }

  #count(unknown) {
    let frames = 0;
    for (const origin of this.origins.values()) if (origin.unknown === unknown) frames += origin.frames.size;
    return frames;
  }

  #hold(origin, sequence, data) {
    if (!origin || origin.frames.has(sequence)) return;
    origin.frames.set(sequence, data);
    this.bytes += data.length;
  }

  /** Keep a frame of a take; `hello` is that of this start. Returns whether there was room. */
  append(take_id, boot_id, hello, sequence, data) {
    this.full = this.bytes + data.length > this.most;
    if (this.full) {
      this.refused += 1;
      return false;
    }
    const key = keyOf(take_id, boot_id);
    if (!this.origins.has(key)) {
      const origin = { take_id, boot_id, hello: { ...hello, token: "" }, at: Date.now() };
      this.origins.set(key, { ...origin, frames: new Map(), unknown: false });
      this.#change(ORIGINS, key, origin);
    }
    this.#hold(this.origins.get(key), sequence, data);
    this.#change(FRAMES, [take_id, boot_id, sequence], data);
    return true;
  }

  /** Delete frames, by their sequences. */
  drop(key, sequences) {
    const origin = this.origins.get(key);
    for (const sequence of sequences) {
      this.bytes -= origin.frames.get(sequence).length;
      origin.frames.delete(sequence);
      this.#change(FRAMES, [origin.take_id, origin.boot_id, sequence], null);
    }
  }

  /** Delete a take of a start with all its frames. */
  forget(key) {
    const origin = this.origins.get(key);
    if (!origin) return;
    this.drop(key, [...origin.frames.keys()]);
    this.origins.delete(key);
    this.#change(ORIGINS, key, null);
  }

  #change(store, key, data) {
    if (!this.database) return;
    this.changes.push([store, key, data]);
    this.timer ??= setTimeout(() => this.write(), WRITE_MS);
  }

  /** Write to the database what it does not have yet. */
  write() {
    clearTimeout(this.timer);
    this.timer = null;
    if (!this.database || !this.changes.length) return;
    const writing = this.database.transaction([ORIGINS, FRAMES], "readwrite");
    for (const [store, key, data] of this.changes) {
      if (data) writing.objectStore(store).put(data, key);
      else writing.objectStore(store).delete(key);
    }
    writing.commit(); // a page that closes now would abort it
    this.changes = [];
  }
}
