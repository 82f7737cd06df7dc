// Shows the frame of the viewer on a Looking Glass panel, and follows the viewer from frame to frame.
import { useEffect, useRef, useState } from "preact/hooks";
import { panelUrl } from "../../api/operations.js";
import { by } from "../../shared/format.js";
import { Panel } from "./panel.js";
import { castPicture } from "./pictures.js";

const OFF = { isOn: false, said: "", fault: "" };

// `frame` is null while none can be shown. Returns {isOffered, isOn, toggle, said, fault}.
export function useCast(job, frame, atlases) {
  const [state, setState] = useState(OFF);
  const panel = useRef(null);
  const isBusy = useRef(false);
  const now = useRef(null);
  now.current = { job, frame };

  const isOpen = () => panel.current?.socket?.readyState === WebSocket.OPEN;
  const stop = (fault = "") => {
    panel.current?.close();
    panel.current = null;
    setState({ ...OFF, fault });
  };
  // One picture at a time, and then the newest.
  const follow = async () => {
    if (isBusy.current) return;
    isBusy.current = true;
    const to = panel.current;
    let sent = null;
    try {
      while (panel.current === to && now.current.frame !== null && now.current.frame !== sent) {
        const { job, frame } = now.current;
        const { bytes, ...layout } = await castPicture(job, frame, atlases);
        await to.show(layout, bytes);
        sent = frame;
        const said = `On the panel: frame ${frame}, a quilt of ${by(layout.columns, layout.rows)} views.`;
        if (panel.current === to) setState({ isOn: true, said, fault: "" });
      }
    } catch (error) {
      if (panel.current === to) stop(error.message);
    } finally {
      isBusy.current = false;
      if (panel.current !== to && isOpen()) follow(); // It was opened anew meanwhile.
    }
  };
  const start = async () => {
    const opened = new Panel(panelUrl, () => panel.current === opened && stop("The bridge of the panel has gone."));
    panel.current = opened;
    setState({ isOn: true, said: "Connecting to the panel …", fault: "" });
    try {
      await opened.open();
      if (panel.current === opened) follow();
    } catch (error) {
      if (panel.current === opened) stop(error.message);
    }
  };
  useEffect(() => {
    if (isOpen()) follow();
  }, [frame]);
  useEffect(() => () => void panel.current?.close(), []);
  return { ...state, isOffered: panelUrl !== "", toggle: () => (panel.current ? stop() : start()) };
}
