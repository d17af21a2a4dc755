// Shows as many columns of a table as fit; a button shows the others. Says where something scrolls.

const LEAST_COLUMNS = 2;
const columnRules = document.createElement("style");
const hiddenFrom = new Set();

/**
 * Show only the first columns of a table; its style needs two rules for each number of columns.
 *
 * A row that is empty in all of these columns is hidden too, as the last ones of a matrix of pairs.
 */
function showColumns(table, count, total) {
  if (count >= total) {
    delete table.dataset.columns;
    return;
  }
  if (!hiddenFrom.has(count)) {
    hiddenFrom.add(count);
    const rows = `[data-columns="${count}"] tr`;
    columnRules.append(
      `@media screen { ${rows} > :nth-child(n + ${count + 1}) { display: none; } }\n`,
      `@media screen { ${rows}:not(:has(> :nth-child(n + 2):nth-child(-n + ${count}):not(:empty))) { display: none; } }\n`,
    );
    if (!columnRules.isConnected) document.head.append(columnRules);
  }
  table.dataset.columns = count;
}

/** Return how many columns of a table fit, all of them being shown. */
function fittingColumns(table, room) {
  const { left } = table.getBoundingClientRect();
  const edges = [...table.tHead.rows[0].cells].map((head) => head.getBoundingClientRect().right - left);
  return Math.max(LEAST_COLUMNS, edges.filter((edge) => edge <= room + 1).length);
}

function fitColumns(box) {
  const table = box.querySelector("table");
  const total = table.tHead.rows[0].cells.length;
  const bar = document.createElement("p");
  const button = document.createElement("button");
  const hint = document.createElement("span");
  bar.className = "columns";
  button.type = "button";
  bar.append(button, hint);
  box.after(bar);
  let wanted = false;

  function fit() {
    // A folded section has no width; it is measured when it opens.
    const room = box.parentElement.clientWidth - 2;
    if (room <= 0) return;
    box.scrollLeft = 0;
    showColumns(table, total, total);
    const fitting = fittingColumns(table, room);
    showColumns(table, wanted ? total : fitting, total);
    button.hidden = fitting >= total;
    button.setAttribute("aria-expanded", String(wanted));
    button.textContent = wanted ? `Show the first ${fitting} columns` : `Show all ${total} columns`;
    const aside = box.scrollWidth > box.clientWidth + 1;
    const down = box.scrollHeight > box.clientHeight + 1;
    const rows = down ? `${table.tBodies[0].rows.length} rows: scroll down to see all.` : "";
    hint.textContent = [aside ? "Scroll sideways to see all columns." : "", rows].filter(Boolean).join(" ");
    bar.hidden = button.hidden && !hint.textContent;
  }

  button.addEventListener("click", () => {
    wanted = !wanted;
    fit();
  });
  // The width of what surrounds the table: that of the table depends on its columns.
  let width = -1;
  new ResizeObserver(([entry]) => {
    if (Math.abs(entry.contentRect.width - width) < 1) return;
    width = entry.contentRect.width;
    fit();
  }).observe(box.parentElement);
}
