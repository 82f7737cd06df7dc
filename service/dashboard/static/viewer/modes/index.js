// The modes of the viewer, one a module. A mode is an object; `given` is {job, frame, frameViews, stand, change,
// isPainted, size, room, home}, where `size` is that of the picture in px, and `room` that of the stage:
//   name           what the picture is, for its label
//   hint           how it is steered
//   movesEye       true if the pointer moves the place of the eye while the graphics card draws
//   needsAll       true if it is drawn only from an atlas with all views
//   filled(frameViews, stand)       the stand with the defaults of this frame
//   query(given)                    [what, query]: the picture of the service that shows the same
//   stepped(given, [across, down])  the patch of the stand for an arrow key; right and down are positive. The scene
//                                   follows the hand, as behind glass, so the eye goes to the other side
//   dragged(given, across, down)    the patch for a drag by so many parts of the stage; without it a drag pans
//   clicked(given, across, down)    the patch, or a promise of it, for a click at a part of the picture, 0 to 1
//   paint(painter, place, stand, given)  draws by the graphics card; without it, the picture of the service is shown
//   said(given)                     the description beside the frame number
//   Controls                        the component below the picture; it gets `given`, isFree and hold()
//   Picture                         a component in place of the picture of the service; see sheet.js
//   Overlay                         a component over the picture; it gets `given`, styleOf(size) and `follow`, a ref of
//                                   {place, draw}: draw(place) is called with every next place of the eye
// `stand` is described in stand.js; `change(patch)` changes it.
import { focus } from "./focus.js";
import { look } from "./look.js";
import { observer } from "./observer.js";
import { sheet } from "./sheet.js";

export const MODES = { look, focus, observer, sheet };
export const TITLES = [
  ["look", "Look"],
  ["focus", "Focus"],
  ["observer", "Observer"],
  ["sheet", "Sheet"],
];
