"""A stream that the test plays: as many events as a busy farm sends in an hour reach the page in some minutes.

Everything else of the page is real, and its requests are answered by the service.
"""

from __future__ import annotations

from typing import Any

from playwright.sync_api import CDPSession, Page

PLAYED = """
window.streams = new Set();
window.EventSource = class extends EventTarget {
  constructor() {
    super();
    window.streams.add(this);
    setTimeout(() => this.dispatchEvent(new Event("open")));
  }
  close() { window.streams.delete(this); }
};
window.hear = (kind, data) => {
  const message = new MessageEvent(kind, { data: JSON.stringify(data) });
  for (const stream of window.streams) stream.dispatchEvent(message);
};
// What is held outside of the heap of the page.
window.held = { bitmaps: 0, urls: 0 };
const make = window.createImageBitmap;
window.createImageBitmap = async (...given) => {
  const bitmap = await make(...given);
  window.held.bitmaps++;
  return bitmap;
};
const close = ImageBitmap.prototype.close;
ImageBitmap.prototype.close = function () {
  if (this.width) window.held.bitmaps--;
  return close.call(this);
};
const [name, forget] = [URL.createObjectURL, URL.revokeObjectURL];
URL.createObjectURL = (thing) => (window.held.urls++, name.call(URL, thing));
URL.revokeObjectURL = (url) => (window.held.urls--, forget.call(URL, url));
"""
"""A script for the start of a page: `hear(kind, data)` is an event, `held` counts what the page has to free."""

BUSY = """async ({ job, from, events, pause_ms, at_once }) => {
  const channel = new MessageChannel();
  channel.port1.start();
  const nextTask = () => new Promise((go) => {
    channel.port1.addEventListener("message", go, { once: true });
    channel.port2.postMessage(null);
  });
  const random = (below) => Math.floor(Math.random() * below);
  const frames = ["rendering", "done", "failed", "waiting"];
  for (let at = from; at < from + events; at++) {
    const kind = at % 20;
    if (kind < 10) {
      hear("progress", { id: job.id, progress: (at % 1000) / 1000, frames_done: at % 7, eta_s: at % 90 });
    } else if (kind < 17) {
      hear("frame", { job: job.id, frame: 1 + (at % job.frames_total), status: frames[random(4)] });
    } else if (kind < 19) {
      // Other jobs come and change; of an hour, some hundreds.
      const id = "9z" + String(Math.floor(at / 40)).padStart(15, "0");
      const status = kind === 17 ? "running" : "done";
      hear("job", { ...job, id, title: `Job ${id}`, status, progress: random(100) / 100 });
    } else {
      hear("job", { ...job, cpu_s: at });
    }
    if (at % at_once === 0) await (pause_ms ? new Promise((go) => setTimeout(go, pause_ms)) : nextTask());
  }
}"""
"""Play events of an open job and of others, `at_once` in a row; without a pause each row is a task of its own."""


def measures(page: Page, cdp: CDPSession) -> dict[str, float]:
    """Return what the page holds after a garbage collection: heap in kB, nodes, listeners, bitmaps and blob URLs."""
    for _ in range(2):
        cdp.send("HeapProfiler.collectGarbage")
    found: dict[str, Any] = {one["name"]: one["value"] for one in cdp.send("Performance.getMetrics")["metrics"]}
    held: dict[str, int] = page.evaluate("() => window.held")
    heap_kb = cdp.send("Runtime.getHeapUsage")["usedSize"] / 1000
    return {"heap_kB": heap_kb, "nodes": found["Nodes"], "listeners": found["JSEventListeners"], **held}
