// The depth maps that were loaded last, by their paths.
import { getNumbers } from "../../api/operations.js";
import { parsePfm } from "./depth_map.js";
import { Shelf } from "../painting/shelf.js";

export const depthMaps = new Shelf({
  load: async (path, signal) => parsePfm(await getNumbers(path, signal)),
  bytesOf: ({ depths_mm }) => depths_mm.byteLength,
  close: () => {},
  limit_bytes: 16 * 2 ** 20,
});
