// Draws views and refocused pictures from the atlas of a frame with WebGL2.
import { BLEND, ENLARGE, EVERYWHERE, GUIDED, REFOCUS } from "./shaders.js";
import { LEFT, RIGHT } from "./stereo.js";
import { blend, numbersAt, presence, substitutes } from "./views.js";

// The largest texture side that phones support, 64 MiB. Of more views the atlas has evenly spaced ones. An array of
// textures would hold them all, but 45 x 45 views of 200 x 200 need 0.3 GB of memory, and as much again as a bitmap;
// the depth guides the eye between views that are there.
export const MAX_ATLAS_PX = 4096;
const LAYERS = 10; // of depths: those of eight views and two eyes
const QUICK_PX = 256 ** 2;
const PLAIN = [1, 0, 0, 0, 1, 0, 0, 0, 1];
const BACKGROUND = [0x0c / 255, 0x0e / 255, 0x0f / 255]; // That of the stage, in stage.css.

export class Painter {
  // Throws if WebGL2 is not available.
  constructor(canvas) {
    // The buffer is preserved so that users can save the picture of the canvas.
    const wanted = { alpha: false, antialias: false, depth: false, preserveDrawingBuffer: true };
    const gl = canvas.getContext("webgl2", wanted);
    if (!gl || gl.getParameter(gl.MAX_TEXTURE_SIZE) < MAX_ATLAS_PX) throw new Error("There is no WebGL2 for this.");
    this.canvas = canvas;
    this.gl = gl;
    // Those of a first picture; the others are made when they are used.
    this.programs = { [BLEND]: program(gl, BLEND), [ENLARGE]: program(gl, ENLARGE) };
    this.frameViews = null;
    this.target = null;
    const named = gl.getExtension("WEBGL_debug_renderer_info");
    const renderer = String(gl.getParameter(named ? named.UNMASKED_RENDERER_WEBGL : gl.RENDERER));
    this.isSoftware = /swiftshader|llvmpipe|software/i.test(renderer);
  }

  // Uploads the atlas of a frame and deletes the one before.
  load(frameViews, bitmap) {
    const { gl } = this;
    for (const old of [this.atlas, this.present, this.picture]) gl.deleteTexture(old);
    const present = Uint8Array.from(presence(frameViews), (is) => (is ? 255 : 0));
    gl.pixelStorei(gl.UNPACK_ALIGNMENT, 1);
    gl.pixelStorei(gl.UNPACK_COLORSPACE_CONVERSION_WEBGL, gl.NONE);
    this.atlas = texture(gl, gl.SRGB8_ALPHA8, bitmap.width, bitmap.height);
    gl.texSubImage2D(gl.TEXTURE_2D, 0, 0, 0, gl.RGBA, gl.UNSIGNED_BYTE, bitmap);
    const [us, vs] = [frameViews.atlas.us.length, frameViews.atlas.vs.length];
    this.present = texture(gl, gl.R8, us, vs);
    gl.texSubImage2D(gl.TEXTURE_2D, 0, 0, 0, us, vs, gl.RED, gl.UNSIGNED_BYTE, present);
    this.picture = texture(gl, gl.SRGB8_ALPHA8, frameViews.view_cols, frameViews.view_rows);
    this.target ??= gl.createFramebuffer();
    gl.bindFramebuffer(gl.FRAMEBUFFER, this.target);
    gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0, gl.TEXTURE_2D, this.picture, 0);
    this.stands = substitutes(frameViews);
    this.frameViews = frameViews;
    this.guide(null);
  }

  // Names the depths along which the views are mixed; null mixes them where they are.
  guide(guide) {
    const { gl } = this;
    gl.deleteTexture(this.depths);
    this.depths = null;
    this.guided = guide;
    if (!guide) return;
    this.depths = gl.createTexture();
    gl.bindTexture(gl.TEXTURE_2D_ARRAY, this.depths);
    gl.texStorage3D(gl.TEXTURE_2D_ARRAY, 1, gl.R16F, guide.map.cols, guide.map.rows, LAYERS);
    unfiltered(gl, gl.TEXTURE_2D_ARRAY);
    this.layers = Array(LAYERS).fill(null);
  }

  // Puts the depths of a view or an eye into a layer.
  layer(index, number, depthsOf) {
    const { gl, layers, guided } = this;
    if (layers[index] === String(number)) return;
    layers[index] = String(number);
    const { rows, cols } = guided.map;
    const depths_mm = depthsOf(number);
    gl.texSubImage3D(gl.TEXTURE_2D_ARRAY, 0, 0, 0, index, cols, rows, 1, gl.RED, gl.FLOAT, depths_mm);
  }

  // Draws the view from a position of the eye.
  around(place, isSmooth) {
    this.mixed([[place, PLAIN]], isSmooth);
  }

  // Draws the picture for red-cyan glasses from the positions of two eyes.
  anaglyph(left, right, isSmooth) {
    this.mixed(
      [
        [left, LEFT],
        [right, RIGHT],
      ],
      isSmooth,
    );
  }

  // Draws the sum of the views from several positions, each with its shares of the colours, by rows.
  mixed(eyes, isSmooth) {
    const { gl } = this;
    const cells = eyes.flatMap(([place]) => blend(this.frameViews, this.stands, place));
    // At a view there is nothing to mix. Depths of many pixels take long.
    const isLate = this.isQuick && this.frameViews.view_rows * this.frameViews.view_cols > QUICK_PX;
    const isGuided = this.guided && !isLate && cells.some(({ share }) => share > 0 && share < 1);
    const use = this.begin(isGuided ? GUIDED : BLEND, this.atlas);
    if (isGuided) this.along(use, eyes, cells);
    gl.uniform1i(use("eyes"), eyes.length);
    gl.uniformMatrix3fv(
      use("colours"),
      true,
      eyes.flatMap(([, colours]) => colours),
    );
    gl.uniform2iv(
      use("cell"),
      cells.flatMap(({ at }) => at),
    );
    gl.uniform1fv(
      use("share"),
      cells.map(({ share }) => share),
    );
    this.end(isSmooth);
  }

  // Sets the depths along which the cells are mixed, four an eye.
  along(use, eyes, cells) {
    const { gl, guided, frameViews } = this;
    const numbers = eyes.map(([place]) => numbersAt(frameViews, place));
    gl.activeTexture(gl.TEXTURE1);
    gl.bindTexture(gl.TEXTURE_2D_ARRAY, this.depths);
    gl.pixelStorei(gl.UNPACK_ALIGNMENT, 1);
    cells.forEach(({ number }, index) => this.layer(index, number, (view) => guided.depthsOfView(view)));
    numbers.forEach((number, index) => this.layer(LAYERS - 2 + index, number, (eye) => guided.depths(eye)));
    gl.activeTexture(gl.TEXTURE0);
    gl.uniform1i(use("depths"), 1);
    gl.uniform2fv(use("lensesPerMm"), frameViews.depths.lenses_per_mm);
    gl.uniform2fv(
      use("away"),
      cells.flatMap(({ number }, index) => number.map((each, axis) => each - numbers[index >> 2][axis])),
    );
  }

  // Draws the picture that is sharp at a depth.
  focused(depth_mm, isSmooth) {
    const { gl, frameViews } = this;
    const use = this.begin(REFOCUS, this.atlas);
    gl.activeTexture(gl.TEXTURE1);
    gl.bindTexture(gl.TEXTURE_2D, this.present);
    gl.activeTexture(gl.TEXTURE0);
    gl.uniform1i(use("present"), 1);
    gl.uniform2i(use("grid"), frameViews.atlas.us.length, frameViews.atlas.vs.length);
    gl.uniform2fv(
      use("movement"),
      frameViews.depths.lenses_per_mm.map((lenses) => lenses * depth_mm),
    );
    this.end(isSmooth);
  }

  // Begins a picture of the screen: nothing is on the canvas, and drawing goes to the whole of it. `rectIn(size)` is
  // the rectangle of the picture in a part of the canvas, and `isQuick` allows less exact enlargement.
  start({ rectIn, isQuick }) {
    const { gl, canvas } = this;
    this.rectIn = rectIn;
    this.isQuick = isQuick;
    this.into({ left: 0, width: canvas.width, mask: [true, true, true] });
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
    gl.disable(gl.SCISSOR_TEST);
    gl.clearColor(...BACKGROUND, 1);
    gl.clear(gl.COLOR_BUFFER_BIT);
  }

  // What is drawn next goes to the columns `left` to `left + width` of the canvas, and to the colours of the mask.
  into({ left, width, mask }) {
    this.part = { left, width, mask };
  }

  begin(shader, source) {
    const { gl, frameViews } = this;
    const { linked, use } = (this.programs[shader] ??= program(gl, shader));
    gl.bindFramebuffer(gl.FRAMEBUFFER, this.target);
    gl.viewport(0, 0, frameViews.view_cols, frameViews.view_rows);
    gl.useProgram(linked);
    gl.bindTexture(gl.TEXTURE_2D, source);
    gl.uniform2i(use("size"), frameViews.view_cols, frameViews.view_rows);
    return use;
  }

  end(isSmooth) {
    const { gl, frameViews, canvas, part } = this;
    gl.drawArrays(gl.TRIANGLES, 0, 3);
    const { linked, use } = this.programs[ENLARGE];
    const rect = this.rectIn({ width: part.width, height: canvas.height });
    const left = Math.max(part.left, Math.round(part.left + rect.left));
    const right = Math.min(part.left + part.width, Math.round(part.left + rect.left + rect.width));
    const top = Math.max(0, Math.round(rect.top));
    const bottom = Math.min(canvas.height, Math.round(rect.top + rect.height));
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
    gl.viewport(0, 0, canvas.width, canvas.height);
    gl.enable(gl.SCISSOR_TEST);
    gl.scissor(left, canvas.height - bottom, Math.max(0, right - left), Math.max(0, bottom - top));
    gl.colorMask(...part.mask, true);
    gl.useProgram(linked);
    gl.bindTexture(gl.TEXTURE_2D, this.picture);
    gl.uniform2i(use("size"), frameViews.view_cols, frameViews.view_rows);
    gl.uniform4f(use("rect"), part.left + rect.left, rect.top, rect.width, rect.height);
    gl.uniform1f(use("canvasRows"), canvas.height);
    gl.uniform1i(use("filtering"), isSmooth ? (this.isQuick ? 1 : 2) : 0);
    gl.drawArrays(gl.TRIANGLES, 0, 3);
    gl.colorMask(true, true, true, true);
    gl.disable(gl.SCISSOR_TEST);
  }

  // Browsers allow few contexts, so this one is released.
  close() {
    this.gl.getExtension("WEBGL_lose_context")?.loseContext();
  }
}

function texture(gl, format, width, height) {
  const made = gl.createTexture();
  gl.bindTexture(gl.TEXTURE_2D, made);
  gl.texStorage2D(gl.TEXTURE_2D, 1, format, width, height);
  unfiltered(gl, gl.TEXTURE_2D);
  return made;
}

// Textures need no filter, because the shaders read single texels.
function unfiltered(gl, kind) {
  gl.texParameteri(kind, gl.TEXTURE_MIN_FILTER, gl.NEAREST);
  gl.texParameteri(kind, gl.TEXTURE_MAG_FILTER, gl.NEAREST);
}

function program(gl, fragments) {
  const linked = gl.createProgram();
  for (const [kind, text] of [
    [gl.VERTEX_SHADER, EVERYWHERE],
    [gl.FRAGMENT_SHADER, fragments],
  ]) {
    const shader = gl.createShader(kind);
    gl.shaderSource(shader, text);
    gl.compileShader(shader);
    gl.attachShader(linked, shader);
  }
  gl.linkProgram(linked);
  if (!gl.getProgramParameter(linked, gl.LINK_STATUS)) throw new Error(gl.getProgramInfoLog(linked) || "not linked");
  const places = new Map();
  const use = (name) => {
    if (!places.has(name)) places.set(name, gl.getUniformLocation(linked, name));
    return places.get(name);
  };
  return { linked, use };
}
