// Maps of sweeps: what the pointer is on, and the command that runs a member.

const decoded = new Map();

/** Return the numbers of a packed array; it is decoded once. */
function numbersOf(packed) {
  if (!decoded.has(packed)) decoded.set(packed, flat(packed));
  return decoded.get(packed);
}

/** Return a number as a text with four digits. */
const short = (value) => String(Number(value.toPrecision(4)));

/** Return a value on an axis: its category, or the number with its unit. */
function valueText({ categories, unit }, value) {
  if (categories.length) return categories[Math.round(value)] ?? "";
  return unit ? `${short(value)} ${unit}` : short(value);
}

/** Return the values of the map of a panel, row by row; NaN where there is none. */
function mapValues(name, panel) {
  const { data, cells } = drawings[name];
  const values = numbersOf(data.find((trace) => trace.coloraxis && trace.meta.panel === panel).z);
  return cells[panel].scale.log ? values.map((power) => 10 ** power) : values;
}

/** Return the names of the marks of a map at the middle of a cell, such as its smallest value. */
function marksAt(name, panel, x, y) {
  const { data } = drawings[name];
  const marked = data.filter((trace) => trace.customdata && trace.meta.panel === panel);
  return marked.filter((trace) => {
    const [across, up] = [numbersOf(trace.x), numbersOf(trace.y)];
    return across.some((value, i) => Math.fround(value) === Math.fround(x) && Math.fround(up[i]) === Math.fround(y));
  }).map((trace) => trace.legendgroup);
}

/** Return what a cell of a map holds: lines of text, its member (-1: none), and what that is. */
function cellAt(name, panel, row, column) {
  const { panels, cells, arrays } = drawings[name];
  const map = cells[panel];
  const { title } = panels[panel];
  const [x, y] = [numbersOf(arrays[map.x]), numbersOf(arrays[map.y])];
  const place = row * x.length + column;
  const value = mapValues(name, panel)[place];
  // The title says of which condition the map is, or only of which quantity.
  const condition = panels.length > 1 && title !== map.scale.text ? [title] : [];
  const lines = [
    ...condition,
    ...marksAt(name, panel, x[column], y[row]),
    `${panels[panel].x.label} = ${valueText(panels[panel].x, x[column])}`,
    `${panels[panel].y.label} = ${valueText(panels[panel].y, y[row])}`,
  ];
  if (!Number.isNaN(value)) lines.push(`${map.scale.label}: ${valueText(map.scale, value)}`);
  if (map.counts === undefined) return { lines, member: -1, role: "" };
  const [count, member, gap] = ["counts", "shown", "gaps"].map((key) => numbersOf(arrays[map[key]])[place]);
  if (gap >= 0) lines.push(`${map.scale.label}: no value, ${map.reasons[gap]}`);
  const role = count > 1 ? `${map.role} of ${count < 10000 ? count : count.toLocaleString("en-US")} members` : "";
  lines.push(count === 0 ? "no member" : `member ${member}${role && `, ${role}`}`);
  return { lines, member, role };
}

/** Return what the point of an event of plotly shows; null for anything but a map or a member. */
function pointed(name, { points }) {
  const { data, cells, command } = drawings[name];
  const point = points[0];
  const trace = data[point.curveNumber];
  if (trace?.type === "heatmap" && cells[trace.meta.panel]) return cellAt(name, trace.meta.panel, ...point.pointNumber);
  if (trace?.customdata && command) return { lines: [], member: trace.customdata[point.pointNumber], role: "" };
  return null;
}

/** Show what is under the pointer, and after a click the command of its member. */
function followPointer(name, { place, box }) {
  const { cells, data, command } = drawings[name];
  if (!cells.some(Boolean) && !data.some((trace) => trace.customdata)) return;
  const tip = box.appendChild(Object.assign(document.createElement("div"), { className: "tip", hidden: true }));
  place.on("plotly_hover", (event) => {
    const found = pointed(name, event);
    tip.hidden = !found?.lines.length;
    if (tip.hidden) return;
    const lines = command && found.member >= 0 ? [...found.lines, "Click: the command that runs it"] : found.lines;
    tip.textContent = lines.join("\n");
    const { left, top, width } = box.getBoundingClientRect();
    const [x, y] = [event.event.clientX - left, event.event.clientY - top];
    const isRight = x > width / 2;
    Object.assign(tip.style, { top: `${y + 14}px`, left: isRight ? "" : `${x + 14}px`, right: isRight ? `${width - x + 14}px` : "" });
  });
  place.on("plotly_unhover", () => (tip.hidden = true));
  place.on("plotly_click", (event) => {
    const found = pointed(name, event);
    if (command && found && found.member >= 0) showCommand(box, `${command} ${found.member}`, found);
  });
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
  note.replaceChildren(`Member ${member}${role && ` (${role})`} runs by `, code, " ", word);
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
