// A button in each column header sorts the table: ascending, descending, original order.

const NEXT = { none: "ascending", ascending: "descending", descending: "none" };
const collator = new Intl.Collator("en", { numeric: true });

/** Return the number or text by which a row is sorted; NaN or "" where there is no value. */
function sortKey(row, column) {
  const cell = row.cells[column];
  const text = cell.querySelector("a")?.textContent ?? cell.lastChild?.textContent ?? "";
  return cell.dataset.value === undefined ? text : readNumber(cell.dataset.value);
}

// Numbers as Python writes them.
const readNumber = (text) => ({ inf: Infinity, "-inf": -Infinity, nan: NaN })[text] ?? Number(text);

const isMissing = (key) => key === "" || Number.isNaN(key);

function compare(a, b) {
  if (typeof a === "number" && typeof b === "number") return a < b ? -1 : Number(a > b);
  return collator.compare(String(a), String(b));
}

function sortTable(body, original, column, order) {
  let rows = [...original];
  if (order !== "none") {
    const sign = order === "ascending" ? 1 : -1;
    const keyed = rows.map((row) => ({ row, key: sortKey(row, column) }));
    const present = keyed.filter(({ key }) => !isMissing(key));
    const missing = keyed.filter(({ key }) => isMissing(key));
    present.sort((a, b) => sign * compare(a.key, b.key));
    rows = [...present, ...missing].map(({ row }) => row);
  }
  body.append(...rows);
}

function makeSortable(table) {
  const heads = [...table.tHead.rows[0].cells];
  const body = table.tBodies[0];
  const original = [...body.rows];
  heads.forEach((head, column) => {
    const button = document.createElement("button");
    button.type = "button";
    button.append(...head.childNodes);
    head.append(button);
    head.setAttribute("aria-sort", "none");
    button.addEventListener("click", () => {
      const order = NEXT[head.getAttribute("aria-sort")];
      for (const other of heads) other.setAttribute("aria-sort", "none");
      head.setAttribute("aria-sort", order);
      sortTable(body, original, column, order);
    });
  });
}
