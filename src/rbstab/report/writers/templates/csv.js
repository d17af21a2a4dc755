// The data of a figure as CSV, from what is drawn: the columns are those of `rbstab plot -o NAME.csv`.

const COLUMNS = ["panel", "x_axis", "y_axis", "series", "x", "y", "low", "high", "value"];

/** Return a position on an axis: a category by its name. */
const named = ({ categories }, value) => (Number.isInteger(value) && categories[value]) || value;

const quoted = (entry) => (/[",\n]/.test(String(entry)) ? `"${String(entry).replace(/"/g, '""')}"` : String(entry ?? "nan"));

/** Return x, y, low, high and value of a row of a layer; what an axis cannot show is null. */
function entriesOf({ x, y, low = "", high = "", value = "" }, axes) {
  const place = (axis, at) => (at === undefined ? "" : named(axis, at ?? NaN));
  return [place(axes.x, x), place(axes.y, y), low, high, value];
}

function csvOf(name) {
  const rows = [COLUMNS];
  drawings[name].panels.forEach((panel, number) => {
    const head = [panel.title || number + 1, panel.x.text, panel.y.text];
    for (const { mark, data } of layersOf(name, number)) {
      for (const row of data.values) rows.push([...head, (mark.type === "line" && row.text) || row.series, ...entriesOf(row, panel)]);
    }
    if (panel.map) rows.push(...cellRows(panel.map).map((row) => [...head, panel.map.scale.text, ...row]));
  });
  return rows.map((row) => row.map(quoted).join(",")).join("\n") + "\n";
}

function cellRows(map) {
  return Array.from(numbersOf(map.values), (value, cell) => {
    const shown = map.scale.categories.length ? map.scale.categories[value] ?? "nan" : Number(value.toPrecision(7));
    return [map.x[cell % map.x.length], map.y[Math.floor(cell / map.x.length)], "", "", Number.isNaN(value) ? "nan" : shown];
  });
}

/** Offer content to the reader as a file. */
function saveFile(content, filename) {
  const link = document.createElement("a");
  link.href = URL.createObjectURL(content);
  link.download = filename;
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 1000);
}
