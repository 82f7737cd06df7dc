// The address as the state of a component.
import { useEffect, useState } from "preact/hooks";
import { read, watch } from "./address.js";

export function useAddress() {
  const [here, setHere] = useState(read);
  useEffect(() => {
    let before = location.hash;
    const follow = () => {
      if (location.hash === before) return;
      before = location.hash;
      setHere(read());
    };
    return watch(follow);
  }, []);
  return here;
}
