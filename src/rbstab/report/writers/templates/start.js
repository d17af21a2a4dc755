// Runs when the page opens, is resized, or is printed.

const PAPER = 680;

/** Call back when an element comes near the window, and when it leaves. */
function observe(element, callback) {
  new IntersectionObserver(([entry]) => callback(entry.isIntersecting), { rootMargin: "300px" }).observe(element);
}

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
  drawings = JSON.parse(await inflated("page.drawings"));
  for (const box of boxes) {
    try {
      prepare(box);
      observe(box, (near) => near && draw(figures.get(box.dataset.name)));
    } catch (error) {
      failed(box, error);
    }
  }
  // Load Vega before the page is printed: printing does not wait for it.
  (globalThis.requestIdleCallback ?? setTimeout)(() => loadLibrary());
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
