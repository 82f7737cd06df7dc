// A bounded store of loaded things by key. The oldest unused ones are thrown away; what is in use stays.

export class Shelf {
  // `load(key, signal)` returns a promise of a thing; `bytesOf(thing)` is its size, and `close(thing)` frees it.
  constructor({ load, bytesOf, close, limit_bytes }) {
    this.load = load;
    this.bytesOf = bytesOf;
    this.close = close;
    this.limit_bytes = limit_bytes;
    this.used = null; // the key of what is shown, which is never thrown away
    this.slots = new Map(); // key -> {thing, promise, fault, end}; the most recently used is last
    this.bytes = 0;
  }

  // The thing, if it is loaded.
  peek(key) {
    return this.slots.get(key)?.thing ?? null;
  }

  // A promise of the thing; it is loaded once.
  get(key) {
    const known = this.slots.get(key);
    if (known) {
      this.slots.delete(key);
      this.slots.set(key, known);
      return known.promise;
    }
    const end = new AbortController();
    const slot = { thing: null, end, promise: null };
    slot.promise = this.load(key, end.signal).then(
      (thing) => {
        if (this.slots.get(key) !== slot) {
          this.close(thing); // It was thrown away before it came.
          throw new Error("This picture is no longer wanted.");
        }
        slot.thing = thing;
        this.bytes += this.bytesOf(thing);
        this.tidy(key);
        return thing;
      },
      (error) => {
        if (this.slots.get(key) === slot) this.slots.delete(key);
        throw error;
      },
    );
    this.slots.set(key, slot);
    return slot.promise;
  }

  // Throws away the least recently used things beyond the limit, but neither `kept` nor what is being loaded.
  tidy(kept) {
    for (const [key, { thing }] of [...this.slots]) {
      if (this.bytes <= this.limit_bytes) return;
      if (key !== kept && key !== this.used && thing) this.drop(key);
    }
  }

  // Names the thing that is shown, which is never thrown away.
  use(key) {
    this.used = key;
  }

  drop(key) {
    const slot = this.slots.get(key);
    if (!slot) return;
    this.slots.delete(key);
    slot.end.abort();
    if (!slot.thing) return;
    this.bytes -= this.bytesOf(slot.thing);
    this.close(slot.thing);
  }

  clear() {
    for (const key of [...this.slots.keys()]) this.drop(key);
  }
}
