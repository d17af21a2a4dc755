// Figures: each is drawn when the reader scrolls near it; the first one also loads Vega.

/** Return a text that was packed with gzip and base64. */
async function inflated(id) {
  const packed = document.getElementById(id).textContent;
  const bytes = Uint8Array.from(atob(packed), (letter) => letter.charCodeAt(0));
  return new Response(new Blob([bytes]).stream().pipeThrough(new DecompressionStream("gzip"))).text();
}

let drawings = {};
const figures = new Map();
let library = null;

/** Run Vega, Vega-Lite and Vega-Embed, once. */
function loadLibrary() {
  library ??= inflated("page.library").then((text) => {
    const script = document.createElement("script");
    script.textContent = text;
    document.head.append(script);
  });
  return library;
}

const NARROW = 620;
const BESIDE_PANEL = 72;
const BESIDE_MAP = 62;
const BELOW = 60;

/** Return whether a figure has maps with bars of colours. */
const hasBars = ({ panels }) => panels.some(({ map }) => map && !map.scale.categories.length);

/** Return the number of columns of a figure in a width, and the width of a panel. */
function sizes(drawing, width) {
  const { columns, panels } = drawing;
  const bars = hasBars(drawing);
  const isNarrow = width < NARROW;
  const count = Math.min(isNarrow ? 1 : columns, panels.length);
  return [count, Math.max(Math.floor(width / count) - BESIDE_PANEL - (bars && !isNarrow ? BESIDE_MAP : 0), 90)];
}

/** Return the specification of a figure in a width, in the colours of the page. */
function fitted(figure, width) {
  const { spec, panels, shared } = drawings[figure.name];
  const fit = structuredClone(spec);
  const [count, inside] = sizes(drawings[figure.name], width);
  fit.columns = count;
  fit.concat.forEach((panel, number) => {
    panel.width = inside;
    if (panels[number].square) panel.height = inside;
    for (const { encoding } of panel.layer) {
      // Panels with one vertical axis: its title stands at the first of each row.
      if (shared.includes("y") && number % fit.columns && encoding.y) encoding.y.title = null;
      if (width < NARROW && encoding.fill?.legend) Object.assign(encoding.fill.legend, { orient: "bottom", gradientLength: inside });
    }
  });
  const values = signalsOf(figure);
  for (const param of fit.params) if (param.name in values) param.value = values[param.name];
  return fit;
}

/** Return the signals that the page sets: colours, hidden curves, and the time. */
function signalsOf(figure) {
  const values = { ink: tone("text"), paper: "transparent", grid: tone("grid"), hidden: [...figure.hidden] };
  if (drawings[figure.name].time) values.now = clock.end > 0 ? clock.now : -1;
  return values;
}

/** Prepare a figure: its legend, its buttons, and its height before it is drawn. */
function prepare(box) {
  const name = box.dataset.name;
  const figure = { name, box, hidden: new Set(), view: null };
  reserve(figure);
  addLegend(figure);
  addButtons(figure);
  figures.set(name, figure);
}

/** Give a figure the height that it will have, so that nothing below moves when it is drawn. */
function reserve({ name, box }) {
  // What is folded has no width yet.
  if (!box.clientWidth) return;
  const { panels, spec } = drawings[name];
  const [count, inside] = sizes(drawings[name], box.clientWidth);
  const bar = hasBars(drawings[name]) && box.clientWidth < NARROW ? BESIDE_MAP : 0;
  const height = Math.max(...spec.concat.map((panel) => panel.height));
  const row = (panels.some(({ square }) => square) ? inside : height) + BELOW + bar;
  box.style.minHeight = `${Math.ceil(panels.length / count) * row}px`;
}

function draw(figure) {
  figure.drawing ??= (async () => {
    await loadLibrary();
    figure.place = figure.box.appendChild(document.createElement("div"));
    await embed(figure);
    follow(figure);
  })().catch((error) => failed(figure.box, error));
  return figure.drawing;
}

/** How Vega draws: without eval, which the policy of the page forbids (`ast`). */
const OPTIONS = { mode: "vega-lite", ast: true, renderer: "svg", actions: false, tooltip: false };

/** Draw a figure anew in a width; its zoom is lost. */
async function embed(figure, width = figure.box.clientWidth) {
  figure.width = width;
  figure.view?.finalize();
  reserve(figure);
  const { view, vgSpec } = await vegaEmbed(figure.place, fitted(figure, width), OPTIONS);
  figure.view = view;
  figure.spots = spotsOf(figure, vgSpec);
}

/** Give a drawn figure the colours of the page, the hidden curves and the time. */
function refresh(figure) {
  if (!figure.view) return;
  for (const [name, value] of Object.entries(signalsOf(figure))) figure.view.signal(name, value);
  // At once: printing does not wait.
  figure.view.run();
}

const refreshAll = () => figures.forEach(refresh);

/** Draw again what has another width now. */
function resizeAll() {
  for (const figure of figures.values()) {
    if (figure.view && figure.width !== figure.box.clientWidth) embed(figure);
  }
}

/** Return where the panels are: their places in the drawing, and their scales. */
function spotsOf({ view, name }, { scales = [] }) {
  const names = new Set(scales.map((scale) => scale.name));
  const spots = [];
  const walk = (item, x, y) => {
    for (const mark of item.items ?? []) {
      const number = /^p(\d+)_group$/.exec(mark.name ?? "")?.[1];
      for (const group of mark.marktype === "group" ? mark.items : []) {
        const [left, top] = [x + (group.x || 0), y + (group.y || 0)];
        if (number === undefined) walk(group, left, top);
        else {
          const { width, height } = group;
          const scale = (side) => (names.has(`p${number}_${side}`) ? `p${number}_${side}` : side);
          spots.push({ number: Number(number), left, top, width, height, x: scale("x"), y: scale("y") });
        }
      }
    }
  };
  for (const group of view.scenegraph().root.items) walk(group, group.x || 0, group.y || 0);
  return spots.map((spot) => ({ ...spot, panel: drawings[name].panels[spot.number] }));
}

/** Return the panel under the pointer and the place in it, in pixels of the drawing; null beside all panels. */
function spotAt({ view, place, spots }, event) {
  const picture = place.querySelector("svg");
  const frame = picture.getBoundingClientRect();
  const shrunk = picture.viewBox.baseVal.width / frame.width;
  const [left, top] = view.origin();
  const { left: padLeft = 0, top: padTop = 0 } = view.padding();
  for (const spot of spots) {
    const x = (event.clientX - frame.left) * shrunk - left - padLeft - spot.left;
    const y = (event.clientY - frame.top) * shrunk - top - padTop - spot.top;
    if (x >= 0 && y >= 0 && x <= spot.width && y <= spot.height) return { ...spot, at: [x, y] };
  }
  return null;
}

/** Return the layers of a panel that have data of their own: not edges of curves, nor counts in bars. */
const layersOf = (name, number) =>
  drawings[name].spec.concat[number].layer.filter(({ mark, data }) => mark.aria !== false && data.values[0]?.series !== undefined);

const NEAR = 14;
const MOST = 8;

/** Return a number as a text with four digits. */
const short = (value) => String(Number(Number(value).toPrecision(4)));

/** Return a value on an axis: its category, or the number with its unit. */
function valueText({ categories, unit }, value) {
  if (categories.length) return categories[Math.round(value)] ?? "";
  return unit && unit !== "1" ? `${short(value)} ${unit}` : short(value);
}

/** Return what is under the pointer: lines of text, and the member of a sweep (-1: none). */
function shownAt(figure, event) {
  const spot = spotAt(figure, event);
  if (!spot) return null;
  const { panel, number, at } = spot;
  const [x, y] = [figure.view.scale(spot.x), figure.view.scale(spot.y)];
  if (panel.map) return cellAt(figure, spot, x.invert(at[0]), y.invert(at[1]));
  const point = nearestPoint(figure, number, at, x, y);
  if (point) return { ...point, spot };
  return valuesAt(figure, spot, x, y);
}

/** Return the point near the pointer, or the part of a bar under it. */
function nearestPoint(figure, number, [left, top], x, y) {
  let best = null;
  let least = NEAR ** 2;
  const axes = drawings[figure.name].panels[number];
  for (const { mark, data } of layersOf(figure.name, number)) {
    if (mark.type !== "point" && mark.type !== "bar") continue;
    for (const row of data.values) {
      if (row.x === null || row.y === null || figure.hidden.has(row.series)) continue;
      const inBar = left >= x(row.low) && left <= x(row.high) && Math.abs(y(row.y) - top) <= mark.size / 2;
      const distance = mark.type === "point" ? (x(row.x) - left) ** 2 + (y(row.y) - top) ** 2 : inBar ? 0 : Infinity;
      if (distance < least) [best, least] = [{ ...row, isBar: inBar }, distance];
    }
  }
  if (!best) return null;
  if (best.isBar) return { lines: [axes.y.categories[best.y], `${best.series}: ${best.text}`], member: -1 };
  const ends = [`${axes.x.label} = ${valueText(axes.x, best.x)}`, `${axes.y.label} = ${valueText(axes.y, best.y)}`];
  return { lines: [best.series, ...(best.text ? best.text.split("\n") : ends)].filter(Boolean), member: best.member ?? -1 };
}

/** Return the values of the curves of a panel at the pointer. */
function valuesAt(figure, spot, x, y) {
  const { panel, number, at } = spot;
  const place = x.invert(at[0]);
  const curves = [];
  for (const { mark, data } of layersOf(figure.name, number)) {
    if (mark.type !== "line" && mark.type !== "area") continue;
    const rows = data.values;
    if (rows.length < 2 || figure.hidden.has(rows[0].series)) continue;
    // A curve that goes back and forth, such as an orbit, has no one value at a place.
    if (!ascends(rows)) continue;
    const value = curveAt(rows, place, panel, mark.interpolate === "step-after");
    if (value !== null) curves.push([rows[0].text ?? rows[0].series, value, Math.abs(y(value) - at[1])]);
  }
  const nearest = curves.sort((a, b) => a[2] - b[2]).slice(0, MOST);
  if (!nearest.length) return null;
  const lines = nearest.map(([label, value]) => `${label || panel.y.label} = ${valueText(panel.y, value)}`);
  return { lines: [`${panel.x.label} = ${valueText(panel.x, place)}`, ...lines], member: -1, spot };
}

const ascending = new WeakMap();

/** Return whether a curve goes from left to right only. */
function ascends(rows) {
  if (!ascending.has(rows)) ascending.set(rows, rows.every(({ x }, k) => x !== null && (k === 0 || x >= rows[k - 1].x)));
  return ascending.get(rows);
}

/** Return the value of a curve at a place, on the straight line that is drawn there; null where it has none. */
function curveAt(rows, place, axes, isStep) {
  if (place < rows[0].x || place > rows.at(-1).x) return null;
  let [low, high] = [0, rows.length - 1];
  while (high - low > 1) {
    const middle = (low + high) >> 1;
    if (rows[middle].x <= place) low = middle;
    else high = middle;
  }
  const [before, after] = [rows[low], rows[high]];
  const top = "high" in before ? "high" : "y";
  const [first, second] = [before[top], after[top]];
  if (first === null || second === null) return null;
  if (isStep || after.x === before.x) return first;
  const [from, to, at] = [before.x, after.x, place].map(axes.x.log ? Math.log : Number);
  const share = (at - from) / (to - from);
  return axes.y.log ? first * (second / first) ** share : first + (second - first) * share;
}

/** Show what is under the pointer; after a click the command of its member, or the motions at that time. */
function follow(figure) {
  const { box, name } = figure;
  const { command, time } = drawings[name];
  const tip = box.appendChild(Object.assign(document.createElement("div"), { className: "tip", hidden: true }));
  const frame = box.appendChild(Object.assign(document.createElement("div"), { className: "cell", hidden: true }));
  const hide = () => (tip.hidden = frame.hidden = true);
  const show = (event) => {
    const shown = shownAt(figure, event);
    tip.hidden = !shown;
    frame.hidden = !shown?.cell;
    if (!shown) return;
    tip.textContent = (command && shown.member >= 0 ? [...shown.lines, "Click: the command that runs it"] : shown.lines).join("\n");
    const { left, top, width } = box.getBoundingClientRect();
    const [x, y] = [event.clientX - left, event.clientY - top];
    const isRight = x > width / 2;
    Object.assign(tip.style, { top: `${y + 14}px`, left: isRight ? "" : `${x + 14}px`, right: isRight ? `${width - x + 14}px` : "" });
    if (shown.cell) placeFrame(figure, frame, shown);
  };
  figure.place.addEventListener("pointermove", show);
  figure.place.addEventListener("pointerleave", (event) => event.pointerType !== "touch" && hide());
  // A tap counts where the finger went down: a browser may move the click of a touch.
  let down = null;
  figure.place.addEventListener("pointerdown", (event) => {
    down = event;
    if (event.pointerType === "touch") show(event);
  });
  figure.place.addEventListener("pointerup", (event) => {
    const isTap = down?.pointerId === event.pointerId && Math.hypot(event.clientX - down.clientX, event.clientY - down.clientY) < 10;
    const shown = isTap && shownAt(figure, down);
    down = null;
    if (!shown) return;
    if (command && shown.member >= 0) showCommand(box, `${command} ${shown.member}`, shown);
    else if (time && clock.end > 0) setTime(figure.view.scale(shown.spot.x).invert(shown.spot.at[0]));
  });
  figure.place.addEventListener("pointercancel", () => (down = null));
  if (time) clock.listeners.push((now) => figure.view.signal("now", clock.end > 0 ? now : -1).runAsync());
}

/** Zoom all panels of a figure about their middle, or show all again. */
function zoom(figure, factor) {
  const { view, spots, name } = figure;
  const { time, spec } = drawings[name];
  const done = new Set();
  for (const { number, x, y } of spots) {
    const selection = time ? "zoom" : `zoom${number}`;
    for (const [side, scale] of time ? [["x", x]] : [["x", x], ["y", y]]) {
      if (done.has(`${selection}_${side}`)) continue;
      done.add(`${selection}_${side}`);
      const isLog = spec.concat[number].layer[0].encoding[side]?.scale?.type === "log";
      const ends = view.scale(scale).domain().map((end) => (isLog ? Math.log(end) : end));
      const [middle, half] = [(ends[0] + ends[1]) / 2, ((ends[1] - ends[0]) * factor) / 2];
      const wanted = [middle - half, middle + half].map((end) => (isLog ? Math.exp(end) : end));
      view.signal(`${selection}_${side}`, factor === 0 ? null : wanted);
    }
  }
  view.runAsync();
}

/** Add a legend: swatches and names, with one button for all curves of a name; maps with other words have a row each. */
function addLegend(figure) {
  const legend = figure.box.parentElement.querySelector(".legend");
  const rows = new Map();
  const rowOf = (of) => {
    if (!rows.has(of)) {
      rows.set(of, legend.appendChild(document.createElement("div")));
      rows.get(of).append(Object.assign(document.createElement("b"), { textContent: of }));
    }
    return rows.get(of);
  };
  for (const entry of drawings[figure.name].legend) {
    const isWord = entry.kind === "word" || entry.kind === "gap";
    const item = document.createElement(isWord ? "span" : "button");
    item.append(swatch(entry), entry.label);
    (entry.of ? rowOf(entry.of) : legend).append(item);
    if (isWord) continue;
    item.type = "button";
    item.setAttribute("aria-pressed", "true");
    item.addEventListener("click", async () => {
      await draw(figure);
      const shown = figure.hidden.delete(entry.label);
      if (!shown) figure.hidden.add(entry.label);
      item.setAttribute("aria-pressed", String(shown));
      refresh(figure);
    });
  }
}

/** Add the buttons of a figure: zoom, picture, data. */
function addButtons(figure) {
  const tools = figure.box.closest(".plot").querySelector(".tools");
  const add = (label, title, work) => {
    const button = Object.assign(document.createElement("button"), { type: "button", textContent: label, title });
    button.setAttribute("aria-label", `${title}: ${figure.box.getAttribute("aria-label")}`);
    button.addEventListener("click", async () => {
      await draw(figure);
      work();
    });
    tools.append(button);
  };
  add("+", "Zoom in", () => zoom(figure, 0.5));
  add("−", "Zoom out", () => zoom(figure, 2));
  add("1:1", "Show all", () => zoom(figure, 0));
  add("SVG", "Save as a picture", () => savePicture(figure));
  add("CSV", "Download the data as CSV", () => saveFile(new Blob([csvOf(figure.name)], { type: "text/csv" }), `${figure.name}.csv`));
  tools.hidden = false;
}

const PICTURE = 900;

/** Save the figure with its legend and without hidden curves, on white and with dark text. */
async function savePicture(figure) {
  const { spec, names, own } = drawings[figure.name];
  const { config, params, ...panels } = fitted(figure, PICTURE);
  const given = Object.fromEntries(spec.params.map(({ name, value }) => [name, value]));
  for (const param of params) if (["ink", "paper", "grid"].includes(param.name)) param.value = given[param.name];
  const whole = names.length ? { config, params, vconcat: [...names, panels], resolve: { scale: own } } : { config, params, ...panels };
  const { view } = await vegaEmbed(document.createElement("div"), whole, OPTIONS);
  saveFile(new Blob([await view.toSVG()], { type: "image/svg+xml" }), `${figure.name}.svg`);
  view.finalize();
}

const SYMBOLS = [
  "M9 6a4 4 0 1 0 8 0a4 4 0 1 0 -8 0", "M9.5 2.5l7 7m0 -7l-7 7", "M9.5 2.5h7v7h-7z", "M13 1.5l4.5 4.5l-4.5 4.5l-4.5 -4.5z",
  "M13 1.5l4.5 8.5h-9z", "M13 10.5l4.5 -8.5h-9z", "M13 1.5v9m-4.5 -4.5h9",
];

/** Return a small picture of the style of a curve. */
function swatch({ kind, colour, dash, symbol }) {
  const make = (name, attributes) => {
    const element = document.createElementNS("http://www.w3.org/2000/svg", name);
    for (const [key, value] of Object.entries(attributes)) element.setAttribute(key, value);
    return element;
  };
  const picture = make("svg", { width: 26, height: 12, "aria-hidden": "true" });
  const box = { x: 3, y: 1, width: 20, height: 10 };
  if (kind === "area" || kind === "word") picture.append(make("rect", { ...box, fill: colour }));
  else if (kind === "gap") {
    picture.append(make("rect", { ...box, fill: "none", stroke: colour }));
    picture.append(make("path", { d: "M4 8L10 2M8 10L16 2M14 10L22 2", stroke: colour, "stroke-width": 1.2 }));
  } else if (kind === "point") picture.append(make("path", { d: SYMBOLS[symbol], stroke: colour, "stroke-width": 1.8, fill: symbol ? "none" : colour }));
  else picture.append(make("path", { d: "M1 6H25", stroke: colour, "stroke-width": 2, fill: "none", "stroke-dasharray": dash.join(" ") }));
  return picture;
}
