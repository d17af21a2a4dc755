// Runs when the page opens, is resized, or is printed.

const PAPER = 680;

/** Call back when an element comes near the window, and when it leaves. */
function observe(element, callback) {
  new IntersectionObserver(([entry]) => callback(entry.isIntersecting), { rootMargin: "300px" }).observe(element);
}

// The style sheet hides these too, but only in recent browsers.
for (const note of document.querySelectorAll(".scriptless")) note.remove();
followTheme();
document.querySelectorAll(".table table").forEach(makeSortable);
document.querySelectorAll(".table .scroll").forEach(fitColumns);
for (const box of document.querySelectorAll(".drawing")) {
  const { layout, narrow } = drawings[box.dataset.name];
  box.style.minHeight = `${(isNarrow(box) ? narrow : layout).height}px`;
  addLegend(box);
  offerData(box.closest(".plot").querySelector(".csv"));
  observe(box, (near) => near && draw(box).catch((error) => failed(box, error)));
}
startClock(addViews(observe));
themeListeners.push(redrawAll, paintAll);

function failed(box, error) {
  const note = document.createElement("p");
  note.className = "failed";
  note.textContent = `This figure cannot be drawn: ${error.message}`;
  box.append(note);
  throw error;
}

let resizing = 0;
addEventListener("resize", () => {
  if (printing) return;
  clearTimeout(resizing);
  resizing = setTimeout(() => (redrawAll(), paintAll()), 150);
});

if (matchMedia("(max-width: 40rem)").matches) document.querySelector(".contents details").open = false;

// Load plotly before the page is printed: printing does not wait for it.
if (Object.keys(drawings).length) (globalThis.requestIdleCallback ?? setTimeout)(() => loadLibrary());

addEventListener("beforeprint", () => {
  printing = true;
  applyTheme();
  if (!globalThis.Plotly) return;
  for (const box of document.querySelectorAll(".drawing")) {
    const name = box.dataset.name;
    if (!figures.has(name)) figures.set(name, { box, narrow: false, cursors: [], hidden: new Set() });
    drawNow(name, figures.get(name));
    redraw(name, figures.get(name), PAPER);
  }
  for (const view of views) {
    view.visible = true;
    view.paint();
  }
});
addEventListener("afterprint", () => {
  printing = false;
  applyTheme();
});
