// The videos of takes in the browser's database until the server has them: parts of some seconds, each made of pieces, so that
// only the last second is lost if the page is closed or killed.
const DATABASE = "capture-studio-video", PARTS = "parts", PIECES = "pieces";
const SPARE = 256 << 20; // bytes of the phone's storage that are left alone
const LEFT_MS = 30 * 24 * 3600 * 1000; // parts of takes that no server knows are deleted after so long

const done = (request) => new Promise((resolve, reject) => {
  request.onsuccess = () => resolve(request.result);
  request.onerror = () => reject(request.error);
});

const ofPart = (id) => IDBKeyRange.bound([id, 0], [id, Infinity]);

export class VideoStore {
  /** `most`: maximum of kept bytes; `failed(error)` is called when the browser could not write. */
  constructor(failed, most = 4 * 2 ** 30) {
    Object.assign(this, { failed, most, database: null });
    this.parts = new Map(); // id -> {id, take_id, name, boot_id, from_sequence, fourcc, width, height, at, bytes}
  }

  /** Read what earlier starts left. Rejects without a database (a private window). */
  async open() {
    const request = indexedDB.open(DATABASE, 1);
    request.onupgradeneeded = () => {
      request.result.createObjectStore(PARTS, { keyPath: "id" });
      request.result.createObjectStore(PIECES);
    };
    this.database = await done(request);
    for (const part of await done(this.database.transaction(PARTS).objectStore(PARTS).getAll())) {
      this.parts.set(part.id, part);
      if (Date.now() - part.at > LEFT_MS) this.delete(part.id);
    }
  }

  /** Size of all parts [bytes]. */
  get bytes() { return [...this.parts.values()].reduce((sum, { bytes }) => sum + bytes, 0); }

  /** Whether there is room for another part. */
  async hasRoom() {
    const { quota = Infinity, usage = 0 } = await navigator.storage?.estimate?.() ?? {};
    return this.bytes < this.most && quota - usage > SPARE;
  }

  /** Add a piece to a part; the first piece begins it. `data`: bytes, `times_ns`: of its frames. */
  append(part, number, data, times_ns) {
    part.bytes += data.length;
    this.parts.set(part.id, part);
    this.#change((parts, pieces) => {
      parts.put(part);
      pieces.put({ data, times_ns }, [part.id, number]);
    });
  }

  /** Return a part's bytes, without the file header, and the times of its frames. */
  async read(id) {
    const pieces = await done(this.database.transaction(PIECES).objectStore(PIECES).getAll(ofPart(id)));
    return { data: pieces.map(({ data }) => data), times_ns: pieces.flatMap(({ times_ns }) => times_ns) };
  }

  delete(id) {
    this.parts.delete(id);
    this.#change((parts, pieces) => {
      parts.delete(id);
      pieces.delete(ofPart(id));
    });
  }

  #change(act) {
    const writing = this.database.transaction([PARTS, PIECES], "readwrite");
    writing.onabort = () => this.failed(writing.error);
    act(writing.objectStore(PARTS), writing.objectStore(PIECES));
    writing.commit(); // a page that closes now would abort it
  }
}
