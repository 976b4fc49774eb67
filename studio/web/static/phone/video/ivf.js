// IVF, the container of a recorded part: a header and one record per frame, with its time since the part's first [µs].
const HEAD = 32, RECORD = 12;

/** Return the file header for pictures of this size; `fourcc`: of the codec. */
export function ivfHead(fourcc, width, height) {
  const data = new Uint8Array(HEAD), view = new DataView(data.buffer);
  data.set(new TextEncoder().encode(`DKIF\0\0\0\0${fourcc}`));
  view.setUint16(6, HEAD, true);
  view.setUint16(12, width, true);
  view.setUint16(14, height, true);
  view.setUint32(16, 1_000_000, true);
  view.setUint32(20, 1, true);
  return data;
}

/** Return an encoded frame as its record. */
export function ivfFrame(chunk, since_us) {
  const data = new Uint8Array(RECORD + chunk.byteLength), view = new DataView(data.buffer);
  view.setUint32(0, chunk.byteLength, true);
  view.setBigUint64(4, BigInt(since_us), true);
  chunk.copyTo(data.subarray(RECORD));
  return data;
}
