// A phone that is tilted turns the scene, as a picture behind its glass.
import { useEffect, useRef, useState } from "preact/hooks";
import { onScreen, tilted } from "./motion.js";

// Browsers tell the orientation only to pages with an encrypted connection, or of the same machine.
const isOffered = () => "DeviceOrientationEvent" in window && isSecureContext && navigator.maxTouchPoints > 0;

// `tilt(place)` is called with every movement, and with null at the end. Returns {isOffered, isOn, toggle}.
export function useTilt(tilt) {
  const [isOn, setOn] = useState(false);
  const now = useRef(tilt);
  now.current = tilt;
  useEffect(() => {
    if (!isOn) return undefined;
    let origin = null;
    const turn = ({ gamma, beta }) => {
      if (gamma === null || beta === null) return;
      origin ??= { gamma, beta };
      const angle_deg = screen.orientation?.angle ?? 0;
      now.current(tilted(...onScreen(gamma - origin.gamma, beta - origin.beta, angle_deg)));
    };
    addEventListener("deviceorientation", turn);
    return () => {
      removeEventListener("deviceorientation", turn);
      now.current(null);
    };
  }, [isOn]);
  const toggle = async () => {
    // Safari asks the user once.
    /** @type {any} */
    const kind = DeviceOrientationEvent;
    const answer = isOn || !kind.requestPermission ? "granted" : await kind.requestPermission().catch(() => "denied");
    if (answer === "granted") setOn(!isOn);
  };
  return { isOffered: isOffered(), isOn, toggle };
}
