// Figures: each is drawn when the reader scrolls near it; the first one also loads plotly.

const drawings = JSON.parse(document.getElementById("page.drawings").textContent);
const figures = new Map();
let library = null;

/** Decompress plotly and run it, once. */
function loadLibrary() {
  library ??= (async () => {
    const packed = document.getElementById("page.library").textContent;
    const bytes = Uint8Array.from(atob(packed), (letter) => letter.charCodeAt(0));
    const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("gzip"));
    const script = document.createElement("script");
    script.textContent = await new Response(stream).text();
    document.head.append(script);
  })();
  return library;
}

const isNarrow = (box) => box.clientWidth < 620;

// No toolbar on touch screens: it would stay over the curves.
const hasToolbar = !matchMedia("(pointer: coarse)").matches;
/** Return a layout in the colours of the page and in a width. */
function themed(layout, width) {
  const [text, grid, line, page] = ["text", "grid", "line", "page"].map(tone);
  const look = { gridcolor: grid, zerolinecolor: line, linecolor: line, tickcolor: line };
  const whole = {
    ...layout,
    width,
    // Keep the zoom when colours or widths change.
    uirevision: "kept",
    font: { ...layout.font, color: text, family: getComputedStyle(document.body).fontFamily },
    paper_bgcolor: "rgba(0,0,0,0)",
    plot_bgcolor: "rgba(0,0,0,0)",
    hoverlabel: { bgcolor: page, bordercolor: line, font: { color: text } },
    modebar: { bgcolor: "rgba(0,0,0,0)", color: tone("soft"), activecolor: text },
    dragmode: hasToolbar ? "zoom" : false,
  };
  for (const key of layout.meta.axes) whole[key] = { ...layout[key], ...look };
  return whole;
}

const TICK_SIZE = "11px";
const SCALE = 2;

/** Return a picture of a figure: an SVG document in which all labels of ticks have one size. */
async function drawnPicture(data, layout) {
  const { width, height } = layout;
  const address = await Plotly.toImage({ data, layout }, { format: "svg", width, height });
  const text = decodeURIComponent(address.slice(address.indexOf(",") + 1));
  const picture = new DOMParser().parseFromString(text, "image/svg+xml");
  // As in the page: plotly draws powers of ten larger, and what is between them smaller.
  for (const label of picture.querySelectorAll('g[class$="tick"] > text')) label.style.fontSize = TICK_SIZE;
  return new XMLSerializer().serializeToString(picture);
}

/** Return an SVG document as the content of a PNG file. */
async function asPng(text, width, height) {
  const image = new Image();
  image.src = `data:image/svg+xml,${encodeURIComponent(text)}`;
  await image.decode();
  const canvas = Object.assign(document.createElement("canvas"), { width: SCALE * width, height: SCALE * height });
  canvas.getContext("2d").drawImage(image, 0, 0, canvas.width, canvas.height);
  return new Promise((resolve) => canvas.toBlob(resolve, "image/png"));
}

/** The entry of a curve in the legend: its own name, or that of the curves among which it is one of many. */
const entryOf = ({ meta, legendgroup }) => meta?.group ?? legendgroup;

/** Save a figure as a PNG file, with its legend and title, on white. */
async function download(name, title) {
  const { data, layout } = drawings[name];
  const escaped = title.replace(/&/g, "&amp;").replace(/</g, "&lt;");
  const named = data.map((trace) => (trace.meta?.group ? { ...trace, name: trace.meta.group } : trace));
  const whole = {
    ...layout,
    width: 1000,
    height: layout.height + 110,
    margin: { ...layout.margin, t: layout.margin.t + 50 },
    title: { text: escaped, font: { size: 15 } },
    showlegend: true,
    paper_bgcolor: "#fff",
    plot_bgcolor: "#fff",
  };
  saveFile(await asPng(await drawnPicture(named, whole), whole.width, whole.height), `${name}.png`);
}

const CAMERA = {
  width: 1000,
  height: 1000,
  path: "M850 250H700l-60-90H360l-60 90H150c-28 0-50 22-50 50v480c0 28 22 50 50 50h700c28 0 50-22 50-50V300c0-28-22-50-50-50zM500 720a180 180 0 1 1 0-360 180 180 0 0 1 0 360z",
};

function settings(name, title) {
  return {
    displaylogo: false,
    displayModeBar: hasToolbar ? "hover" : false,
    // By default plotly has a button that sends the data to a server.
    showSendToCloud: false,
    plotlyServerURL: "",
    modeBarButtonsToRemove: ["toImage", "lasso2d", "select2d", "autoScale2d"],
    modeBarButtonsToAdd: [
      { name: "picture", title: "Save as a picture", icon: CAMERA, click: () => download(name, title) },
    ],
  };
}

async function draw(box) {
  const name = box.dataset.name;
  if (figures.has(name)) return;
  const figure = { box, narrow: isNarrow(box), cursors: [], hidden: new Set() };
  figures.set(name, figure);
  await loadLibrary();
  drawNow(name, figure);
}

function drawNow(name, figure) {
  if (figure.drawn) return;
  figure.drawn = true;
  const { data } = drawings[name];
  const { box } = figure;
  const title = box.getAttribute("aria-label");
  const place = document.createElement("div");
  box.append(place);
  figure.place = place;
  Plotly.newPlot(place, data, layoutOf(name, figure), settings(name, title));
  if (drawings[name].layout.meta.time) followTime(figure);
  followPointer(name, figure);
  place.on("plotly_relayout", () => writeOut(name, figure, place));
}

const FEW_DECADES = 3;

/** Write numbers out on the logarithmic axes that show few powers of ten, as `axes.py` does: 0.2 and not 2. After a zoom, choose other ticks. */
function writeOut(name, figure, place) {
  const drawn = drawings[name][figure.narrow ? "narrow" : "layout"];
  const changes = {};
  for (const key of drawn.meta.axes) {
    const { type, range, tickformat, tickmode } = place._fullLayout[key];
    const { range: whole, dtick } = drawn[key];
    if (whole && dtick) {
      // The ticks of a small or narrow panel are those of its whole axis.
      const mode = range.every((end, k) => end === whole[k]) ? "linear" : "auto";
      if (mode !== tickmode) changes[`${key}.tickmode`] = mode;
    }
    if (type !== "log") continue;
    const few = Math.abs(range[1] - range[0]) < FEW_DECADES;
    const wanted = few ? (Math.min(...range) < -4 || Math.max(...range) > 6 ? "~e" : "~g") : "";
    if (wanted !== tickformat) Object.assign(changes, { [`${key}.tickformat`]: wanted, [`${key}.nticks`]: few ? 3 : 4 });
  }
  if (Object.keys(changes).length) Plotly.relayout(place, changes);
}

const layoutOf = (name, figure, width = figure.box.clientWidth) =>
  themed(structuredClone(drawings[name][figure.narrow ? "narrow" : "layout"]), width);

/** Redraw a figure in the current colours and width; hidden curves stay hidden. */
function redraw(name, figure, width) {
  if (!figure.drawn) return;
  figure.narrow = width ? false : isNarrow(figure.box);
  const layout = layoutOf(name, figure, width);
  layout.shapes.forEach((shape) => (shape.visible = !figure.hidden.has(shape.legendgroup)));
  figure.box.style.minHeight = `${layout.height}px`;
  // Without the settings: with them, plotly 4 never returns.
  Plotly.react(figure.place, figure.place.data, layout);
}

const redrawAll = () => figures.forEach((figure, name) => redraw(name, figure));

/** Draw a cursor in each panel at the time of the animations. */
function followTime(figure) {
  const { place, box } = figure;
  const show = () => {
    const full = place._fullLayout;
    const axes = drawings[box.dataset.name].layout.meta.axes.filter((key) => key.startsWith("x"));
    axes.forEach((key, number) => {
      const x = full[key];
      // Both parts of a split time axis have the same vertical axis.
      const y = full[`yaxis${x.anchor.slice(1)}`];
      figure.cursors[number] ??= box.appendChild(Object.assign(document.createElement("div"), { className: "cursor" }));
      const style = figure.cursors[number].style;
      const at = x.c2p(clock.now);
      style.display = clock.end > 0 && at >= 0 && at <= x._length ? "" : "none";
      style.left = `${x._offset + at}px`;
      style.top = `${y._offset}px`;
      style.height = `${y._length}px`;
    });
  };
  clock.listeners.push(show);
  place.on("plotly_afterplot", show);
  place.on("plotly_click", ({ points }) => clock.end > 0 && setTime(points[0].x));
  show();
}

/** Add a legend: swatches and names, with one button for all curves of a name. */
function addLegend(box) {
  const name = box.dataset.name;
  const { data, layout } = drawings[name];
  const legend = box.parentElement.querySelector(".legend");
  const entries = [...data, ...layout.shapes].filter((entry) => entry.showlegend);
  // The many that share an entry are drawn first, and named last.
  for (const entry of entries.sort((a, b) => Boolean(a.meta?.group) - Boolean(b.meta?.group))) {
    if (entry.type === "scatter" && entry.meta.mark === "cells") {
      // A word of a map: there is no curve to hide.
      const word = document.createElement("span");
      word.append(swatch(entry), entry.legendgroup);
      legend.append(word);
      continue;
    }
    const button = document.createElement("button");
    button.type = "button";
    button.setAttribute("aria-pressed", "true");
    button.append(swatch(entry), entryOf(entry));
    button.addEventListener("click", () => toggle(name, box, entryOf(entry), button));
    legend.append(button);
  }
}

async function toggle(name, box, group, button) {
  await draw(box);
  const figure = figures.get(name);
  const shown = figure.hidden.has(group);
  if (shown) figure.hidden.delete(group);
  else figure.hidden.add(group);
  button.setAttribute("aria-pressed", String(shown));
  const numbers = drawings[name].data.flatMap((trace, i) => (entryOf(trace) === group ? [i] : []));
  if (numbers.length) await Plotly.restyle(figure.place, { visible: shown }, numbers);
  const shapes = {};
  drawings[name].layout.shapes.forEach((shape, i) => {
    if (shape.legendgroup === group) shapes[`shapes[${i}].visible`] = shown;
  });
  if (Object.keys(shapes).length) await Plotly.relayout(figure.place, shapes);
}

const DASHES = { dash: "6 4", dot: "2 3", dashdot: "7 3 2 3" };
const svg = (name, attributes) => {
  const element = document.createElementNS("http://www.w3.org/2000/svg", name);
  for (const [key, value] of Object.entries(attributes)) element.setAttribute(key, value);
  return element;
};

/** Return a small picture of the style of a curve. */
function swatch(entry) {
  const picture = svg("svg", { width: 26, height: 12, "aria-hidden": "true" });
  const { type, line, marker, colorscale } = entry;
  // That of a bar, or the tone of the cells of a map that have no value.
  const fillcolor = entry.fillcolor ?? (type === "bar" ? marker.color : colorscale?.[1][1]);
  if (fillcolor) picture.append(svg("rect", { x: 3, y: 1, width: 20, height: 10, fill: fillcolor }));
  else if (marker) picture.append(svg("path", symbol({ ...marker, color: entry.meta.key ?? marker.color })));
  else {
    const d = "M1 6H25";
    // The edges of a curve on a map: without them its dark middle is lost on a dark page.
    if (entry.meta?.edges) {
      picture.append(svg("path", { d, stroke: entry.meta.edges, "stroke-width": 6 }));
    }
    const dash = DASHES[line.dash] ? { "stroke-dasharray": DASHES[line.dash] } : {};
    picture.append(svg("path", { d, stroke: line.color, "stroke-width": 2, fill: "none", ...dash }));
  }
  return picture;
}

function symbol({ color, symbol: kind = "circle" }) {
  const path = {
    circle: "M9 6a4 4 0 1 0 8 0a4 4 0 1 0 -8 0",
    x: "M9.5 2.5l7 7m0 -7l-7 7",
    "square-open": "M9.5 2.5h7v7h-7z",
    "diamond-open": "M13 1.5l4.5 4.5l-4.5 4.5l-4.5 -4.5z",
    "triangle-up-open": "M13 1.5l4.5 8.5h-9z",
    "triangle-down-open": "M13 10.5l4.5 -8.5h-9z",
    "cross-thin-open": "M13 1.5v9m-4.5 -4.5h9",
  }[kind];
  return { d: path, stroke: color, "stroke-width": 1.8, fill: kind === "circle" ? color : "none" };
}
