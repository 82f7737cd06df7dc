// A link into the documentation. It opens beside the form, which keeps what is filled in.
import { link } from "../../api/operations.js";
import { html } from "../../shared/html.js";

/** @param {{ page: string, children?: any }} to */
export const Documented = ({ page, children }) =>
  html`<a class="documented" href=${link(`/help/${page}`)} target="_blank">${children}</a>`;
