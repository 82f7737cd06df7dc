// The atlases of the frames of a job: a small one for the first picture and for playing, and the whole one for looking.
import { getFrameViews, getPicture, link } from "../../api/operations.js";
import { Shelf } from "./shelf.js";
import { isWhole } from "./views.js";
import { MAX_ATLAS_PX } from "./webgl.js";

// The largest atlas that is loaded as PNG, from which the browser refocuses; a larger one is loaded as lossy WebP.
const EXACT_PX = 2048 ** 2;
const MEMORY_BYTES = 192 * 2 ** 20;
const DESCRIPTIONS = 500;

const area = ({ atlas }) => atlas.rows * atlas.cols;
// Whether the atlas has every view with every code, so that the browser refocuses as the service does.
export const isExact = (frameViews) => isWhole(frameViews) && area(frameViews) <= EXACT_PX;

export class Atlases {
  constructor(job) {
    this.job = job;
    this.described = new Shelf({
      load: (frame, signal) => getFrameViews(job, frame, MAX_ATLAS_PX, signal),
      bytesOf: () => 1,
      close: () => {},
      limit_bytes: DESCRIPTIONS,
    });
    this.shelf = new Shelf({
      load: (key, signal) => this.load(...key.split(" "), signal),
      bytesOf: ({ bitmap }) => bitmap.width * bitmap.height * 4,
      close: ({ bitmap }) => bitmap.close(),
      limit_bytes: MEMORY_BYTES,
    });
  }

  describe(frame) {
    return this.described.get(frame);
  }

  // A promise of {frame, frameViews, bitmap}. The size is "first" or "whole".
  get(frame, size) {
    return this.shelf.get(`${frame} ${size}`);
  }

  isLoaded(frame, size) {
    return this.shelf.peek(`${frame} ${size}`) !== null;
  }

  // Names the atlas that is shown, which stays in memory.
  use(frame, size) {
    this.shelf.use(`${frame} ${size}`);
  }

  close() {
    this.described.clear();
    this.shelf.clear();
  }

  async load(text, size, signal) {
    const frame = Number(text);
    const described = await this.describe(frame);
    const isPng = size === "whole" && isExact(described);
    const frameViews = size === "first" ? { ...described, atlas: described.first_atlas } : described;
    const url = `${link(frameViews.atlas.url)}&format=${isPng ? "png" : "webp"}`;
    return { frame, size, frameViews, bitmap: await getPicture(url, signal) };
  }
}
