// Which rows of a long list, or columns of a wide one, are drawn: those that can be seen, and some around them.

const AROUND = 6; // Rows beyond each edge, so that a quick scroll shows no gap.

// The first row that is drawn, and the one after the last. `above_px` is how much of the list is above the edge of the
// screen, negative if the list begins below it.
export function visibleRows(above_px, screen_px, row_px, total) {
  const first = Math.floor(above_px / row_px) - AROUND;
  const end = Math.ceil((above_px + screen_px) / row_px) + AROUND;
  return [Math.min(Math.max(0, first), total), Math.max(0, Math.min(total, end))];
}

// The numbers of the pages with some rows.
export function pagesOf(first, end, rows_a_page) {
  const pages = [];
  for (let page = Math.floor(first / rows_a_page); page * rows_a_page < end; page++) pages.push(page);
  return pages;
}

// The ids of rows between two of them, in either direction; rows that are not loaded have none.
export function between(ids, one, other) {
  const found = [];
  for (let row = Math.min(one, other); row <= Math.max(one, other); row++) if (ids[row]) found.push(ids[row]);
  return found;
}
