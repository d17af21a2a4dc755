// Maps of sweeps: what a cell holds, and the command of its member.

/** Return the number of the cell between ascending edges that holds a value; -1 beside all. */
function cellOf(edges, value) {
  if (!(value >= edges[0] && value <= edges.at(-1))) return -1;
  let [low, high] = [0, edges.length - 1];
  while (high - low > 1) {
    const middle = (low + high) >> 1;
    if (edges[middle] <= value) low = middle;
    else high = middle;
  }
  return low;
}

/** Return the numbers of a packed array, row by row; it is unpacked once. */
const arrays = new Map();
function numbersOf(packed) {
  if (!arrays.has(packed)) arrays.set(packed, flat(packed));
  return arrays.get(packed);
}

/** Return what the cell at a place holds: lines of text, its member (-1: none), and what that is. */
function cellAt(figure, spot, x, y) {
  const { panel } = spot;
  const { map } = panel;
  const [column, row] = [cellOf(map.edges[0], x), cellOf(map.edges[1], y)];
  if (column < 0 || row < 0) return null;
  const cell = row * map.x.length + column;
  const value = numbersOf(map.values)[cell];
  const lines = [`${panel.x.label} = ${valueText(panel.x, map.x[column])}`, `${panel.y.label} = ${valueText(panel.y, map.y[row])}`];
  // The title says of which condition the map is, or only of which quantity.
  if (panel.title && panel.title !== map.scale.text) lines.unshift(panel.title);
  if (!Number.isNaN(value)) lines.push(`${map.scale.label}: ${valueText(map.scale, value)}`);
  const shown = { lines, member: -1, role: "", spot, cell: [column, row] };
  const isHere = (point) => cellOf(map.edges[0], point.x) === column && cellOf(map.edges[1], point.y) === row;
  for (const { mark, data } of layersOf(figure.name, spot.number)) {
    const marked = mark.type === "point" && data.values.find((point) => point.member !== undefined && isHere(point));
    if (marked) lines.unshift(marked.series);
  }
  if (!map.counts) return shown;
  const [count, member] = [numbersOf(map.counts)[cell], numbersOf(map.shown)[cell]];
  if (Number.isNaN(value) && count) lines.push(`${map.scale.label}: no value, ${map.reasons[numbersOf(map.gaps)[cell]]}`);
  shown.member = member;
  shown.role = count > 1 ? `${map.role} of ${count < 10000 ? count : count.toLocaleString("en-US")} members` : "";
  lines.push(count === 0 ? "no member" : `member ${member}${shown.role && `, ${shown.role}`}`);
  return shown;
}

/** Put the frame around the cell that is shown. */
function placeFrame(figure, frame, { spot, cell: [column, row] }) {
  const { view, place, box } = figure;
  const picture = place.querySelector("svg").getBoundingClientRect();
  const shrunk = place.querySelector("svg").viewBox.baseVal.width / picture.width;
  const [left, top] = view.origin();
  const { left: padLeft = 0, top: padTop = 0 } = view.padding();
  const outer = box.getBoundingClientRect();
  const [x, y] = [view.scale(spot.x), view.scale(spot.y)];
  const { edges } = spot.panel.map;
  const across = (value) => (x(value) + spot.left + left + padLeft) / shrunk + picture.left - outer.left;
  const down = (value) => (y(value) + spot.top + top + padTop) / shrunk + picture.top - outer.top;
  const [l, r, t, b] = [across(edges[0][column]), across(edges[0][column + 1]), down(edges[1][row + 1]), down(edges[1][row])];
  Object.assign(frame.style, { left: `${l}px`, top: `${t}px`, width: `${Math.max(r - l, 3)}px`, height: `${Math.max(b - t, 3)}px` });
}

/** Show the command that runs a member, below a figure and briefly at the foot of the window; copy it where the browser allows it. */
async function showCommand(box, command, { member, role }) {
  let note = box.parentElement.querySelector(".chosen");
  if (!note) {
    note = Object.assign(document.createElement("p"), { className: "chosen" });
    note.setAttribute("role", "status");
    box.after(note);
  }
  const code = Object.assign(document.createElement("code"), { textContent: command });
  const word = document.createElement("small");
  note.replaceChildren(`Member ${member}${role ? ` (${role})` : ""} runs by `, code, " ", word);
  try {
    await navigator.clipboard.writeText(command);
    word.textContent = "copied";
  } catch {
    // Some browsers allow it on secure pages only; the text can be selected.
    word.textContent = "";
  }
  showBriefly(`Member ${member}${word.textContent ? ", copied" : ""}: `, command);
}

const SHOWN_FOR = 8000;
let brief = null;
let briefly = 0;

/** Show a command for some seconds at the foot of the window: the note below a high figure may be out of sight. */
function showBriefly(words, command) {
  if (!brief) {
    // Hidden from screen readers, which read the note below the figure.
    brief = document.body.appendChild(Object.assign(document.createElement("p"), { className: "brief" }));
    brief.setAttribute("aria-hidden", "true");
  }
  brief.replaceChildren(words, Object.assign(document.createElement("code"), { textContent: command }));
  brief.hidden = false;
  clearTimeout(briefly);
  briefly = setTimeout(() => (brief.hidden = true), SHOWN_FOR);
}
