// One clock for all animations and for the cursors of all figures over time.

const clock = { now: 0, end: 0, playing: false, listeners: [] };

function setTime(time) {
  clock.now = Math.min(Math.max(time, 0), clock.end);
  for (const listener of clock.listeners) listener(clock.now);
}

/** Return how many seconds the whole animation plays: twice its duration, from 6 to 30. */
const playingTime = () => Math.min(Math.max(2 * clock.end, 6), 30);

function startClock(end) {
  const form = document.querySelector(".clock");
  if (!form || !(end > 0)) return;
  const slider = form.querySelector("input");
  const output = form.querySelector("output");
  const button = form.querySelector(".play");
  const digits = Math.max(0, 3 - Math.floor(Math.log10(end)));
  clock.end = end;
  slider.max = end;
  slider.step = end / 1000;
  clock.listeners.push((time) => {
    slider.value = time;
    output.textContent = `${time.toFixed(digits)} s`;
    slider.setAttribute("aria-valuetext", `${time.toFixed(digits)} seconds`);
  });
  slider.addEventListener("input", () => {
    stopPlaying(button);
    setTime(Number(slider.value));
  });
  button.addEventListener("click", () => (clock.playing ? stopPlaying(button) : startPlaying(button)));
  form.addEventListener("submit", (event) => event.preventDefault());
  showNear(form);
  setTime(0);
}

/** Show the bar while a body is on the screen, while they play, and while the bar has the focus. */
function showNear(form) {
  const seen = new Set();
  const show = () => (form.hidden = !(seen.size || clock.playing || form.contains(document.activeElement)));
  const watch = new IntersectionObserver((entries) => {
    for (const { target, isIntersecting } of entries) seen[isIntersecting ? "add" : "delete"](target);
    show();
  });
  for (const body of document.querySelectorAll(".motion")) watch.observe(body);
  clock.changed = show;
  form.addEventListener("focusout", () => setTimeout(show));
}

function stopPlaying(button) {
  clock.playing = false;
  button.textContent = "Play";
  clock.changed?.();
}

function startPlaying(button) {
  clock.playing = true;
  button.textContent = "Pause";
  if (clock.now >= clock.end) setTime(0);
  let before = performance.now();
  const step = (instant) => {
    if (!clock.playing) return;
    const passed = Math.max(instant - before, 0) / 1000;
    before = instant;
    setTime(clock.now + (passed * clock.end) / playingTime());
    if (clock.now >= clock.end) stopPlaying(button);
    else requestAnimationFrame(step);
  };
  requestAnimationFrame(step);
}
