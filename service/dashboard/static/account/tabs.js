// The pages of an account: one's own, and for admins the keys and the audit log.
import { html } from "../shared/html.js";
import { useKnown } from "../state/store.js";

const PAGES = [
  { page: "account", title: "Your account" },
  { page: "keys", title: "Keys" },
  { page: "audit", title: "Audit log" },
];

export function Tabs({ here }) {
  const isAdmin = useKnown((known) => known.session?.role === "admin");
  if (!isAdmin) return null;
  return html`
    <nav class="tabs" aria-label="Account">
      ${PAGES.map(
        ({ page, title }) => html`
        <a key=${page} href="#/${page}" aria-current=${page === here ? "page" : null}>${title}</a>
      `,
      )}
    </nav>
  `;
}

// What somebody without the role sees who opens a page of admins by its address.
export const OnlyAdmins = ({ what }) => html`
  <p class="empty">Only admins see ${what}. Log in with a key of an admin, or ask one.</p>
`;
