// What the bridge of a Looking Glass panel is asked, and what it answers: Looking Glass Bridge, or HoloPlay Service. A
// message is CBOR after four bytes, the number of the request; its highest bit is set (REQ of nanomsg).
import { decode, encode } from "./cbor.js";

export const PROTOCOL = "rep.sp.nanomsg.org";
export const FIRST_NUMBER = 0x80000000;

export const INFO = { info: {} };
export const WIPE = { wipe: {} };
// Shows a picture that comes with the message.
export const showOf = ({ columns, rows, aspect }) => ({
  show: {
    source: "bindata",
    quilt: { type: "image", settings: { vx: columns, vy: rows, vtotal: columns * rows, aspect } },
  },
});

const FAULTS = {
  1: "The bridge could not read the message.",
  2: "The bridge does not know this command.",
  3: "The bridge could not read the picture.",
  4: "No Looking Glass panel is connected.",
  7: "The bridge does not allow this.",
};

// The bytes of a request.
export function requestOf(number, cmd, bin = null) {
  const body = encode({ cmd, bin });
  const bytes = new Uint8Array(4 + body.length);
  new DataView(bytes.buffer).setUint32(0, number);
  bytes.set(body, 4);
  return bytes;
}

// The number of the request, and the answer.
export function answerOf(buffer) {
  const bytes = new Uint8Array(buffer);
  return { number: new DataView(buffer).getUint32(0), answer: decode(bytes.subarray(4)) };
}

// What went wrong, empty if nothing did. A bridge without a panel lists no devices.
export function faultOf({ error, devices }) {
  if (error) return FAULTS[error] ?? `The bridge answered with error ${error}.`;
  return devices?.length === 0 ? FAULTS[4] : "";
}
