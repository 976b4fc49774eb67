// MessagePack (https://msgpack.org), the part that the link needs: nil, booleans, numbers, texts, bytes, lists and maps.
//
// Integers beyond 2^53, such as a server's clock, are BigInt in both directions, so that they keep all digits.

const UTF8 = new TextEncoder(), TEXT = new TextDecoder();

class Writer {
  constructor() {
    this.bytes = new Uint8Array(2048);
    this.view = new DataView(this.bytes.buffer);
    this.at = 0;
  }

  room(count) {
    if (this.at + count > this.bytes.length) {
      const grown = new Uint8Array(2 * (this.at + count));
      grown.set(this.bytes);
      this.bytes = grown;
      this.view = new DataView(grown.buffer);
    }
    const at = this.at;
    this.at += count;
    return at;
  }

  byte(value) { this.view.setUint8(this.room(1), value); }

  /** Write a header with a length: `short` with the length in it below `limit`, else the code for 1, 2 or 4 bytes of length. */
  head(length, short, limit, [one, two, four]) {
    if (length < limit) return this.byte(short | length);
    if (one && length < 0x100) { this.byte(one); return this.byte(length); }
    if (length < 0x10000) { this.byte(two); return this.view.setUint16(this.room(2), length); }
    this.byte(four);
    return this.view.setUint32(this.room(4), length);
  }

  raw(bytes) { const at = this.room(bytes.length); this.bytes.set(bytes, at); }

  integer(value) {
    if (value >= 0 && value < 0x80) return this.byte(Number(value));
    if (value < 0 && value >= -0x20) return this.byte(0x100 + Number(value));
    this.byte(value < 0 ? 0xd3 : 0xcf);
    const at = this.room(8);
    return value < 0 ? this.view.setBigInt64(at, BigInt(value)) : this.view.setBigUint64(at, BigInt(value));
  }

  value(one) {
    if (one === null || one === undefined) return this.byte(0xc0);
    if (typeof one === "boolean") return this.byte(one ? 0xc3 : 0xc2);
    if (typeof one === "bigint" || Number.isInteger(one)) return this.integer(one);
    if (typeof one === "number") { this.byte(0xcb); return this.view.setFloat64(this.room(8), one); }
    if (typeof one === "string") {
      const text = UTF8.encode(one);
      this.head(text.length, 0xa0, 32, [0xd9, 0xda, 0xdb]);
      return this.raw(text);
    }
    if (one instanceof Uint8Array) {
      this.head(one.length, 0, 0, [0xc4, 0xc5, 0xc6]);
      return this.raw(one);
    }
    if (Array.isArray(one)) {
      this.head(one.length, 0x90, 16, [0, 0xdc, 0xdd]);
      return one.forEach((item) => this.value(item));
    }
    const pairs = Object.entries(one);
    this.head(pairs.length, 0x80, 16, [0, 0xde, 0xdf]);
    return pairs.forEach(([key, item]) => { this.value(key); this.value(item); });
  }
}

/** Return a value as bytes. */
export function pack(value) {
  const writer = new Writer();
  writer.value(value);
  return writer.bytes.slice(0, writer.at);
}

/** Return the value in `bytes` (Uint8Array). */
export function unpack(bytes) {
  const view = new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);
  let at = 0;
  const skip = (count) => { at += count; return at - count; };
  const small = (big) => (big >= Number.MIN_SAFE_INTEGER && big <= Number.MAX_SAFE_INTEGER ? Number(big) : big);
  const unsigned = [() => view.getUint8(skip(1)), () => view.getUint16(skip(2)), () => view.getUint32(skip(4)), () => small(view.getBigUint64(skip(8)))];
  const signed = [() => view.getInt8(skip(1)), () => view.getInt16(skip(2)), () => view.getInt32(skip(4)), () => small(view.getBigInt64(skip(8)))];
  const raw = (count) => { if (at + count > bytes.length) throw new RangeError("the message is cut off"); return bytes.slice(skip(count), at); };
  const list = (count) => Array.from({ length: count }, read);
  const map = (count) => Object.fromEntries(Array.from({ length: count }, () => [read(), read()]));

  function read() {
    const code = view.getUint8(skip(1));
    if (code < 0x80) return code;
    if (code < 0x90) return map(code & 0x0f);
    if (code < 0xa0) return list(code & 0x0f);
    if (code < 0xc0) return TEXT.decode(raw(code & 0x1f));
    if (code >= 0xe0) return code - 0x100;
    if (code === 0xc0) return null;
    if (code === 0xc2 || code === 0xc3) return code === 0xc3;
    if (code >= 0xc4 && code <= 0xc6) return raw(unsigned[code - 0xc4]());
    if (code === 0xca) return view.getFloat32(skip(4));
    if (code === 0xcb) return view.getFloat64(skip(8));
    if (code >= 0xcc && code <= 0xcf) return unsigned[code - 0xcc]();
    if (code >= 0xd0 && code <= 0xd3) return signed[code - 0xd0]();
    if (code >= 0xd9 && code <= 0xdb) return TEXT.decode(raw(unsigned[code - 0xd9]()));
    if (code === 0xdc || code === 0xdd) return list(unsigned[code - 0xdb]());
    if (code === 0xde || code === 0xdf) return map(unsigned[code - 0xdd]());
    throw new RangeError(`MessagePack code ${code} is not of this protocol`);
  }
  return read();
}
