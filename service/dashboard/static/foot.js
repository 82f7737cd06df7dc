// The lowest line of the large view: other frames, what is said of this one, files.
import { html } from "./html.js";

export const Foot = ({ frame, step, isFirst, isLast, said, children }) => html`
  <div class="bar foot">
    <button onClick=${() => step(-1)} disabled=${isFirst} aria-label="Frame before">←</button>
    <button onClick=${() => step(1)} disabled=${isLast} aria-label="Next frame">→</button>
    <span class="numbers" aria-live="polite">Frame ${frame}${said && ` · ${said}`}</span>
    <span class="files">${children}</span>
  </div>
`;
