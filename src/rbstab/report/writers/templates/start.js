// Runs when the page opens, is resized, or is printed.

/** Call back when an element comes near the window, and when it leaves. */
function observe(element, callback) {
  new IntersectionObserver(([entry]) => callback(entry.isIntersecting), { rootMargin: "300px" }).observe(element);
}

/** Say in the place of a figure why it is not there. */
function failed(box, error) {
  const note = document.createElement("p");
  note.className = "failed";
  note.textContent = `This figure cannot be drawn: ${error.message}`;
  box.append(note);
  throw error;
}

// The style sheet hides these too, but only in recent browsers.
for (const note of document.querySelectorAll(".scriptless")) note.remove();
followTheme();
document.querySelectorAll(".table table").forEach(makeSortable);
document.querySelectorAll(".table .scroll").forEach(fitColumns);
startClock(addViews(observe));
themeListeners.push(refreshAll, paintAll);

const boxes = [...document.querySelectorAll(".drawing")];
if (boxes.length) {
  // Without it a figure fails when it is prepared, and says so.
  drawings = JSON.parse(await inflated("page.drawings").catch(() => "{}"));
  for (const { panels, arrays } of Object.values(drawings)) {
    for (const { map } of panels) if (map) for (const key of ["values", "counts", "shown", "gaps"]) map[key] = arrays[map[key]];
  }
  for (const box of boxes) {
    try {
      prepare(box);
      observe(box, (near) => near && draw(figures.get(box.dataset.name)));
    } catch (error) {
      setTimeout(() => failed(box, error));
    }
  }
  drawInTurn(boxes);
}

/** Draw all figures that are not folded, one after the other: printing does not wait for them. */
function drawInTurn([box, ...others]) {
  if (!box) return;
  (globalThis.requestIdleCallback ?? setTimeout)(async () => {
    const figure = figures.get(box.dataset.name);
    if (figure && box.clientWidth) await draw(figure).catch(() => {});
    drawInTurn(others);
  });
}

let resizing = 0;
addEventListener("resize", () => {
  if (printing) return;
  clearTimeout(resizing);
  resizing = setTimeout(() => (resizeAll(), paintAll()), 150);
});

if (matchMedia("(max-width: 40rem)").matches) document.querySelector(".contents details").open = false;

addEventListener("beforeprint", () => {
  printing = true;
  applyTheme();
  for (const view of views) {
    view.visible = true;
    view.paint();
  }
});
addEventListener("afterprint", () => {
  printing = false;
  applyTheme();
});
