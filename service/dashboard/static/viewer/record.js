// Records what is on the stage as a video: MP4 where the browser encodes it, otherwise WebM.
import { useEffect, useRef, useState } from "preact/hooks";
import { download } from "./save.js";

const KINDS = [
  ["video/mp4;codecs=avc1.640028", "mp4"],
  ["video/webm;codecs=vp9", "webm"],
  ["video/webm", "webm"],
];
const FPS = 30;
const BITS_PER_S = 12e6;
const LONGEST_MS = 120_000;

const kindHere = () =>
  "MediaRecorder" in window ? KINDS.find(([type]) => MediaRecorder.isTypeSupported(type)) : undefined;

// `canvas()` returns the canvas. Returns {isOffered, isOn, toggle}; the end of a recording downloads it.
export function useRecorder(canvas, name) {
  const [isOn, setOn] = useState(false);
  const stop = useRef(null);
  useEffect(() => () => stop.current?.(), []);
  const begin = () => {
    const [type, ending] = kindHere();
    const stream = canvas().captureStream(FPS);
    const recorder = new MediaRecorder(stream, { mimeType: type, videoBitsPerSecond: BITS_PER_S });
    const parts = [];
    recorder.addEventListener("dataavailable", ({ data }) => parts.push(data));
    recorder.addEventListener("stop", () => {
      stream.getTracks().forEach((track) => track.stop());
      download(new Blob(parts, { type: type.split(";")[0] }), `${name}.${ending}`);
      setOn(false);
    });
    recorder.start();
    const timer = setTimeout(() => stop.current?.(), LONGEST_MS);
    stop.current = () => {
      clearTimeout(timer);
      stop.current = null;
      if (recorder.state !== "inactive") recorder.stop();
    };
    setOn(true);
  };
  return { isOffered: kindHere() !== undefined, isOn, toggle: () => (isOn ? stop.current?.() : begin()) };
}
