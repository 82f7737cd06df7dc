// The form as somebody left it: this tab keeps it, so that a session that ends and a reload lose nothing.

const PLACE = "lippmann-new-job";

// `from` is the job that the form began with, if any. Only the form that was left last is kept.
export function keptDraft(from) {
  try {
    const kept = JSON.parse(sessionStorage.getItem(PLACE));
    return kept?.from === (from ?? null) ? kept.job : null;
  } catch {
    return null; // The browser keeps nothing for this page.
  }
}

export function keepDraft(from, job) {
  try {
    sessionStorage.setItem(PLACE, JSON.stringify({ from: from ?? null, job }));
  } catch {
    // The browser keeps nothing for this page, or has no room.
  }
}

export function forgetDraft() {
  try {
    sessionStorage.removeItem(PLACE);
  } catch {
    // The browser keeps nothing for this page.
  }
}
