// Animations of bodies, at the time of the clock.

const moving = JSON.parse(document.getElementById("page.motions").textContent);
const views = [];
const CONTACT = "#D55E00";
const ANCHOR = "#009E73";
const PULLS = "#CC3311";
const PUSHES = "#0077BB";
const BODY = { light: [122, 143, 166], dark: [138, 160, 184] };
/** px: how far the origin of the axes is from the edges of the view. */
const AXES = 40;
/** px: the longest bar that shows the scale. */
const BAR = 110;
const SUN = unit([0.35, -0.55, 0.9]);

/** Decode a base64 array into rows of a length. */
function unpacked(packed, length) {
  const values = flat(packed);
  return Array.from({ length: values.length / length }, (_, i) => [...values.subarray(i * length, (i + 1) * length)]);
}

class MotionView {
  constructor(canvas) {
    const motion = moving[canvas.dataset.name];
    this.canvas = canvas;
    this.times = unpacked(motion.times, 1).map(([time]) => time);
    this.positions = unpacked(motion.positions, 3);
    this.rotations = unpacked(motion.rotations, 4);
    this.vertices = unpacked(motion.vertices, 3);
    this.triangles = Array.from({ length: motion.triangles.length / 3 }, (_, i) => motion.triangles.slice(3 * i, 3 * i + 3));
    this.contact = motion.contact_point;
    this.anchor = motion.anchor;
    this.ties = motion.ties.map((tie) => ({ ...tie, loads: unpacked(tie.loads, 1).map(([load]) => load) }));
    this.largestLoad = Math.max(...this.ties.flatMap((tie) => tie.loads.map(Math.abs)), 0) || 1;
    this.trace = this.positions.map((X, i) => plus(X, turned(this.rotations[i], this.contact)));
    this.reach = Math.max(...this.vertices.map((v) => hypot(...v)), hypot(...this.contact));
    const [low, high] = this.bounds();
    this.floor = low[2] - this.reach;
    this.camera = new Camera(times(plus(low, high), 0.5), this.reach + hypot(...minus(high, low)) / 2);
    this.body = motion.vertices.bdata;
    this.visible = false;
    this.listen();
  }

  /** Return the corners of a box around all positions of the centre of gravity, and all anchors. */
  bounds() {
    const anchors = this.ties.map((tie) => tie.anchor);
    const places = [...this.positions, ...anchors, ...(this.anchor ? [this.anchor] : [])];
    const along = (axis, pick) => places.reduce((extreme, place) => pick(extreme, place[axis]), places[0][axis]);
    return [Math.min, Math.max].map((pick) => [0, 1, 2].map((axis) => along(axis, pick)));
  }

  /** Return the pose of the body at a time, clamped to the times of the run. */
  at(time) {
    const last = this.times.length - 1;
    let next = this.times.findIndex((other) => other > time);
    if (next === -1) next = last;
    const before = Math.max(next - 1, 0);
    const step = this.times[next] - this.times[before];
    const part = step > 0 ? Math.min(Math.max((time - this.times[before]) / step, 0), 1) : 0;
    const X = plus(times(this.positions[before], 1 - part), times(this.positions[next], part));
    return { X, Q: between(this.rotations[before], this.rotations[next], part), before };
  }

  paint() {
    if (!this.visible) return;
    const { canvas } = this;
    const { clientWidth: width, clientHeight: height } = canvas;
    const scale = devicePixelRatio || 1;
    canvas.width = width * scale;
    canvas.height = height * scale;
    const pen = canvas.getContext("2d");
    pen.scale(scale, scale);
    pen.lineJoin = "round";
    pen.font = `12px ${getComputedStyle(document.body).fontFamily}`;
    const project = this.camera.projection(width, height);
    const pose = this.at(clock.now);
    this.paintGround(pen, project);
    this.paintAxes(pen, height);
    this.paintScale(pen, width, height);
    const painter = new Painter(pen, project);
    this.addBody(painter, pose);
    this.addTrace(painter, pose);
    this.addTies(painter, pose);
    this.addElements(painter, pose);
    painter.paint();
    const numbers = [...pose.X, ...plus(pose.X, turned(pose.Q, this.contact))];
    canvas.dataset.pose = numbers.map((value) => value.toFixed(4)).join(" ");
  }

  paintGround(pen, project) {
    const cell = 10 ** Math.round(Math.log10(this.camera.size / 2));
    const [x, y] = this.camera.middle.map((value) => Math.round(value / cell) * cell);
    const count = Math.ceil((1.6 * this.camera.size) / cell);
    const painter = new Painter(pen, project);
    for (let i = -count; i <= count; i++) {
      const [a, b] = [i * cell, count * cell];
      painter.line([[x + a, y - b, this.floor], [x + a, y + b, this.floor]], tone("grid"), 1);
      painter.line([[x - b, y + a, this.floor], [x + b, y + a, this.floor]], tone("grid"), 1);
    }
    painter.paint();
  }

  /** Paint the directions of the axes in the lower left corner of the view. */
  paintAxes(pen, height) {
    const [left, top] = [AXES, height - AXES];
    pen.lineWidth = 1.6;
    pen.strokeStyle = pen.fillStyle = tone("soft");
    pen.textAlign = "center";
    pen.textBaseline = "middle";
    this.camera.directions().forEach(([right, down], number) => {
      const at = (length) => [left + length * right, top + length * down];
      pen.beginPath();
      pen.moveTo(left, top);
      pen.lineTo(...at(0.55 * AXES));
      pen.stroke();
      pen.fillText(`x${number + 1}`, ...at(0.8 * AXES));
    });
  }

  /** Paint a bar of a round length, as it is at the middle of the view, in the lower right corner. */
  paintScale(pen, width, height) {
    const pixels = this.camera.pixels(width, height);
    const power = 10 ** Math.floor(Math.log10(BAR / pixels));
    const length = [5, 2, 1].map((factor) => factor * power).find((step) => step * pixels <= BAR);
    const [right, y] = [width - 16, height - 14];
    const left = right - length * pixels;
    pen.lineWidth = 1.6;
    pen.strokeStyle = pen.fillStyle = tone("soft");
    pen.beginPath();
    pen.moveTo(left, y - 4);
    pen.lineTo(left, y);
    pen.lineTo(right, y);
    pen.lineTo(right, y - 4);
    pen.stroke();
    pen.textAlign = "right";
    pen.textBaseline = "bottom";
    pen.fillText(`${Number(length.toPrecision(1))} m`, right, y - 6);
    this.canvas.dataset.scale = `${length} m: ${Math.round(length * pixels)} px`;
  }

  addBody(painter, { X, Q }) {
    const colour = BODY[isDark() ? "dark" : "light"];
    const corners = this.vertices.map((vertex) => plus(X, turned(Q, vertex)));
    for (const triangle of this.triangles) {
      const [a, b, c] = triangle.map((number) => corners[number]);
      const normal = unit(cross(minus(b, a), minus(c, a)));
      const light = 0.55 + 0.45 * Math.max(dot(normal, SUN), 0) + 0.12 * Math.max(normal[2], 0);
      painter.triangle([a, b, c], `rgb(${colour.map((part) => Math.min(part * light * 1.15, 255) | 0)})`);
    }
  }

  addTrace(painter, { before, X, Q }) {
    const here = plus(X, turned(Q, this.contact));
    painter.line(this.trace.slice(before), `${CONTACT}40`, 1);
    painter.line([...this.trace.slice(0, before + 1), here], CONTACT, 1.6);
  }

  /** Add the contact point, the line to it from the centre of gravity, the anchor and the connector, in front of the body. */
  addTies(painter, { X, Q }) {
    const here = plus(X, turned(Q, this.contact));
    const over = 10 * this.camera.size;
    painter.line([X, here], CONTACT, 2, { nearer: over });
    if (this.anchor) {
      painter.line([this.anchor, here], ANCHOR, 2.4, { nearer: over });
      painter.disc(this.anchor, 6.5, ANCHOR, tone("page"), -over);
    }
    painter.disc(X, 3.5, tone("text"), tone("page"), -2 * over);
    painter.disc(here, 5, CONTACT, tone("page"), -2 * over);
  }

  /** Add the elements between points of the body and points of space: wider under more load, dashed without load. */
  addElements(painter, { X, Q, before }) {
    const over = 10 * this.camera.size;
    for (const { point, anchor, loads } of this.ties) {
      const load = loads[before];
      const share = Math.abs(load) / this.largestLoad;
      const colour = share < 1e-6 ? tone("soft") : load > 0 ? PULLS : PUSHES;
      const style = share < 1e-6 ? { nearer: over, dash: [3, 4] } : { nearer: over };
      painter.line([anchor, plus(X, turned(Q, point))], colour, 1.2 + 3.3 * Math.sqrt(share), style);
      painter.disc(anchor, 4, colour, tone("page"), -over);
    }
  }

  listen() {
    const { canvas, camera } = this;
    const pointers = new Map();
    canvas.addEventListener("pointerdown", (event) => {
      pointers.set(event.pointerId, event);
      canvas.setPointerCapture(event.pointerId);
    });
    for (const end of ["pointerup", "pointercancel"]) {
      canvas.addEventListener(end, (event) => pointers.delete(event.pointerId));
    }
    canvas.addEventListener("pointermove", (event) => {
      const before = pointers.get(event.pointerId);
      if (!before) return;
      const spread = () => {
        const [a, b] = [...pointers.values()];
        return hypot(a.clientX - b.clientX, a.clientY - b.clientY) || 1;
      };
      const wide = pointers.size === 2 ? spread() : 0;
      pointers.set(event.pointerId, event);
      if (wide) camera.zoom(wide / spread());
      else camera.turn((event.clientX - before.clientX) / 160, (event.clientY - before.clientY) / 160);
      this.paint();
    });
    // The wheel scrolls the page, except with Ctrl or when the view has the focus.
    canvas.addEventListener("wheel", (event) => {
      if (!event.ctrlKey && document.activeElement !== canvas) return;
      event.preventDefault();
      camera.zoom(Math.exp(event.deltaY / 500));
      this.paint();
    }, { passive: false });
    canvas.addEventListener("keydown", (event) => {
      const act = {
        ArrowLeft: () => camera.turn(-0.1, 0),
        ArrowRight: () => camera.turn(0.1, 0),
        ArrowUp: () => camera.turn(0, 0.1),
        ArrowDown: () => camera.turn(0, -0.1),
        "+": () => camera.zoom(1 / 1.15),
        "-": () => camera.zoom(1.15),
        0: () => camera.reset(),
      }[event.key];
      if (!act || event.ctrlKey || event.altKey || event.metaKey) return;
      event.preventDefault();
      act();
      this.paint();
    });
  }
}

const paintAll = () => views.forEach((view) => view.paint());

function addViews(observe) {
  for (const canvas of document.querySelectorAll("canvas")) {
    const view = new MotionView(canvas);
    views.push(view);
    observe(canvas, (near) => {
      view.visible = near;
      view.paint();
    });
  }
  // Equal bodies have one scale.
  for (const view of views) {
    const alike = views.filter((other) => other.body === view.body);
    view.size = Math.max(...alike.map((other) => other.camera.size));
  }
  for (const view of views) {
    view.camera.size = view.size;
    view.camera.reset();
  }
  clock.listeners.push(paintAll);
  return Math.max(0, ...views.map((view) => view.times.at(-1)));
}
