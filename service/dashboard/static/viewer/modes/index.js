// The modes of the viewer, one a module. A mode is an object; `given` is {frameViews, stand, change, isPainted}:
//   name           what the picture is, for its label
//   hint           how it is steered
//   filled(frameViews, stand)       the stand with the defaults of this frame
//   query(given)                    [what, query]: the picture of the service that shows the same
//   stepped(given, [across, down])  the patch of the stand for an arrow key; right and down are positive
//   dragged(given, across, down)    the patch for a drag by so many parts of the stage; without it there is no drag
//   clicked(given, across, down)    the patch, or a promise of it, for a click at a part of the picture, 0 to 1
//   paint(painter, place, stand)    draws by the graphics card; without it, the picture of the service is shown
//   said(given)                     the description beside the frame number
//   Controls                        the component below the picture, with `given` and `pause` as properties
// `stand` is described in stand.js; `change(patch)` changes it.
import { focus } from "./focus.js";
import { look } from "./look.js";
import { observer } from "./observer.js";

export const MODES = { look, focus, observer };
