// The data of a figure as CSV, from what is drawn: the columns are those of `rbstab plot -o NAME.csv`.

const COLUMNS = ["panel", "x_axis", "y_axis", "series", "x", "y", "low", "high", "value"];

/** Return a position on an axis: a category by its name. */
const named = ({ categories }, value) => (Number.isInteger(value) && categories[value]) || value;

const quoted = (entry) => (/[",\n]/.test(String(entry)) ? `"${String(entry).replace(/"/g, '""')}"` : String(entry ?? "nan"));

/** Return x, y, low, high and value of a row of a layer. */
function entriesOf({ type }, row, axes) {
  const [x, y] = [named(axes.x, row.x ?? NaN), named(axes.y, row.y ?? NaN)];
  if (row.bar !== undefined) return [row.x2 - row.x, axes.y.categories[row.bar], "", "", row.count];
  if (row.value !== undefined) return [x, row.value, row.y, row.y2, ""];
  if (type === "rect") return [(row.x + row.x2) / 2, row.y, row.x, row.x2, ""];
  if (type === "area") return row.part === undefined ? [x, "", row.y, row.y2, ""] : [x, row.part, "", "", ""];
  if (row.x === undefined) return ["", y, "", "", ""];
  return row.y === undefined ? [x, "", "", "", ""] : [x, y, "", "", ""];
}

function csvOf(name) {
  const rows = [COLUMNS];
  drawings[name].panels.forEach((panel, number) => {
    const head = [panel.title || number + 1, panel.x.text, panel.y.text];
    for (const { mark, data } of layersOf(name, number)) {
      for (const row of data.values) rows.push([...head, row.text && row.bar === undefined && mark.type === "line" ? row.text : row.series, ...entriesOf(mark, row, panel)]);
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
