// The data of a figure as CSV, from what is drawn: the columns are those of `rbstab plot -o NAME.csv`.

const COLUMNS = ["panel", "x_axis", "y_axis", "series", "x", "y", "low", "high", "value"];

/** Return a number with the digits that its packed array has. */
const digits = (value, packed) => (Number.isNaN(value) ? "nan" : packed?.dtype === "f4" ? Number(value.toPrecision(7)) : value);

/** Return a position on an axis: a category by its name. */
const named = ({ categories }, value) => (Number.isInteger(value) && categories[value]) || value;

const column = (packed) => Array.from(numbersOf(packed), (value) => digits(value, packed));

/** Return the rows of a trace: x, y, low, high and value of each point. */
function traceRows(name, trace, axes) {
  const { mark, panel } = trace.meta;
  // More traces of a map are cells without a value, and words of the legend.
  if (mark === "cells") return trace.coloraxis ? cellRows(name, panel) : [];
  const [x, y] = [column(trace.x), column(trace.y)];
  if (mark === "bars") {
    // The outline of the bars: each edge stands twice in it.
    const edges = x.filter((_, k) => k % 2 === 0);
    return edges.slice(1).map((high, k) => [(edges[k] + high) / 2, y[2 * k + 1], edges[k], high, ""]);
  }
  if (mark === "band") {
    const half = x.length / 2;
    return x.slice(0, half).map((place, k) => [place, "", y[k], y[x.length - 1 - k], ""]);
  }
  if (mark === "intervals") {
    const [up, down] = [column(trace.error_y.array), column(trace.error_y.arrayminus)];
    return x.map((place, k) => [named(axes.x, place), y[k], y[k] - down[k], y[k] + up[k], ""]);
  }
  if (mark === "shares") return x.map((share, k) => [share, named(axes.y, y[k]), "", "", trace.text[k] || 0]);
  return x.map((place, k) => [named(axes.x, place), named(axes.y, y[k]), "", "", ""]);
}

function cellRows(name, panel) {
  const { cells, arrays } = drawings[name];
  const { x, y, scale } = cells[panel];
  const [across, up] = [column(arrays[x]), column(arrays[y])];
  const values = mapValues(name, panel);
  return Array.from(values, (value, place) => [
    across[place % across.length],
    up[Math.floor(place / across.length)],
    "",
    "",
    named(scale, scale.log && !Number.isNaN(value) ? Number(value.toPrecision(6)) : digits(value, { dtype: "f4" })),
  ]);
}

/** Add up the halves of a stack: values above zero are drawn apart from those below. */
function wholeStacks(data) {
  const whole = new Map();
  const others = data.filter((trace) => !trace.stackgroup);
  for (const trace of data.filter((one) => one.stackgroup)) {
    const key = `${seriesOf(trace)} ${trace.xaxis}`;
    const values = numbersOf(trace.y);
    const before = whole.get(key);
    whole.set(key, { trace, sums: before ? before.sums.map((sum, k) => sum + values[k]) : Array.from(values) });
  }
  return { others, stacks: [...whole.values()] };
}

const seriesOf = ({ meta, legendgroup }) => `${meta.panel} ${meta.mark} ${legendgroup ?? ""}`;

/** Return the number of an axis from its name "x", "x2", ... or from "x2 domain". */
const axisNumber = (name) => Number(name.split(" ")[0].slice(1) || 1) - 1;

/** Leave out the points that the second part of a curve shares with the first: a split time axis is two axes. */
function withoutShared(rows, trace, panels, ends) {
  const first = ends.get(seriesOf(trace));
  const kept = axisNumber(trace.xaxis) < panels || first === undefined ? rows : rows.filter(([x]) => x > first);
  if (rows.length) ends.set(seriesOf(trace), rows.at(-1)[0]);
  return kept;
}

const quoted = (entry) => (/[",\n]/.test(String(entry)) ? `"${String(entry).replace(/"/g, '""')}"` : String(entry));

function csvOf(name) {
  const { data, layout, panels, cells } = drawings[name];
  const heads = panels.map(({ title, x, y }, number) => [title || number + 1, x.text, y.text]);
  const rows = [COLUMNS];
  const add = (panel, series, found) => rows.push(...found.map((row) => [...heads[panel], series, ...row]));
  const { others, stacks } = wholeStacks(data);
  const ends = new Map();
  for (const trace of others) {
    const { panel, mark } = trace.meta;
    const series = mark === "cells" ? cells[panel].scale.text : trace.legendgroup ?? "";
    add(panel, series, withoutShared(traceRows(name, trace, panels[panel]), trace, panels.length, ends));
  }
  for (const { trace, sums } of stacks) {
    const places = column(trace.x);
    const points = places.map((x, k) => [x, digits(sums[k], trace.y), "", "", ""]);
    add(trace.meta.panel, trace.legendgroup ?? "", withoutShared(points, trace, panels.length, ends));
  }
  for (const { xref, yref, x0, x1, y0, legendgroup } of layout.shapes) {
    const isVertical = yref.endsWith("domain") && x0 === x1;
    // The border of a split axis is no data, and a horizontal line is drawn on both parts.
    const isBorder = isVertical && xref.endsWith("domain");
    const isSecond = axisNumber(xref) >= panels.length;
    if (isBorder || (isSecond && !isVertical)) continue;
    add(axisNumber(xref) % panels.length, legendgroup ?? "", [isVertical ? [x0, "", "", "", ""] : ["", y0, "", "", ""]]);
  }
  return rows.map((row) => row.map(quoted).join(",")).join("\n") + "\n";
}

/** Offer content to the reader as a file. */
function saveFile(content, filename) {
  const link = document.createElement("a");
  link.href = URL.createObjectURL(content);
  link.download = filename;
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 1000);
}

/** Give the button of a figure its work. */
function offerData(button) {
  button.hidden = false;
  button.addEventListener("click", () => {
    const { name } = button.dataset;
    saveFile(new Blob([csvOf(name)], { type: "text/csv" }), `${name}.csv`);
  });
}
