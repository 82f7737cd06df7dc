// The footer of the lightbox: previous and next frame, a description, and downloads.
import { html } from "../shared/html.js";

export const Footer = ({ frame, step, isFirst, isLast, said, children }) => html`
  <div class="bar foot">
    <button onClick=${() => step(-1)} disabled=${isFirst} aria-label="Previous frame">←</button>
    <button onClick=${() => step(1)} disabled=${isLast} aria-label="Next frame">→</button>
    <span class="numbers" aria-live="polite">Frame ${frame}${said && ` · ${said}`}</span>
    <span class="files">${children}</span>
  </div>
`;
