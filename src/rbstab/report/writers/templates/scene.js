// A small 3D renderer (painter's algorithm): a scene consists of triangles and lines, and the
// farthest are painted first.

const { hypot, sin, cos } = Math;
const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const minus = (a, b) => [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
const plus = (a, b) => [a[0] + b[0], a[1] + b[1], a[2] + b[2]];
const times = (a, s) => [a[0] * s, a[1] * s, a[2] * s];
const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
const unit = (a) => times(a, 1 / (hypot(...a) || 1));

/** Return a vector rotated by a unit quaternion (w, x, y, z). */
function turned([w, x, y, z], v) {
  const u = [x, y, z];
  const t = times(cross(u, v), 2);
  return plus(plus(v, times(t, w)), cross(u, t));
}

/** Interpolate two unit quaternions; part is from 0 to 1. */
function between(p, q, part) {
  const sign = p[0] * q[0] + p[1] * q[1] + p[2] * q[2] + p[3] * q[3] < 0 ? -1 : 1;
  const mixed = p.map((value, i) => (1 - part) * value + part * sign * q[i]);
  const size = hypot(...mixed) || 1;
  return mixed.map((value) => value / size);
}

/** The focal length of the camera, in units of the shorter side of the view. */
const FOCUS = 1.55;

/** A camera that looks at a centre from a distance; the third axis points upwards. */
class Camera {
  constructor(middle, size) {
    this.middle = middle;
    this.size = size;
    this.reset();
  }

  /** Set the default view; a sphere of this size around the centre is fully visible in any rotation. */
  reset() {
    this.azimuth = -0.95;
    this.elevation = 0.32;
    this.distance = 1.02 * this.size * hypot(1, 2 * FOCUS);
  }

  /** Return how many pixels a metre at the middle of the view has. */
  pixels(width, height) {
    return (FOCUS * Math.min(width, height)) / this.distance;
  }

  turn(right, up) {
    this.azimuth -= right;
    this.elevation = Math.min(Math.max(this.elevation + up, -1.5), 1.5);
  }

  zoom(factor) {
    this.distance = Math.min(Math.max(this.distance * factor, 1.2 * this.size), 20 * this.size);
  }

  /** Return the unit vectors towards the camera, to the right and up in the view. */
  frame() {
    const outward = [cos(this.elevation) * cos(this.azimuth), cos(this.elevation) * sin(this.azimuth), sin(this.elevation)];
    const right = [-sin(this.azimuth), cos(this.azimuth), 0];
    return [outward, right, cross(outward, right)];
  }

  /** Return the directions of the axes in the view, [right, down] each; a part of them points into it. */
  directions() {
    const [, right, up] = this.frame();
    return [0, 1, 2].map((axis) => [right[axis], -up[axis]]);
  }

  /** Return a function that projects a point to [x, y, depth] in the view. */
  projection(width, height) {
    const [outward, right, up] = this.frame();
    const eye = plus(this.middle, times(outward, this.distance));
    const scale = FOCUS * Math.min(width, height);
    this.outward = outward;
    return (point) => {
      const from = minus(point, eye);
      const depth = Math.max(-dot(from, outward), 1e-3 * this.size);
      return [width / 2 + (scale * dot(from, right)) / depth, height / 2 - (scale * dot(from, up)) / depth, depth];
    };
  }
}

/** A list of shapes, added in any order and painted by depth. */
class Painter {
  constructor(context, project) {
    this.context = context;
    this.project = project;
    this.shapes = [];
  }

  line(points, colour, width, { nearer = 0, dash = [] } = {}) {
    const places = points.map(this.project);
    for (let i = 1; i < places.length; i++) {
      const pair = [places[i - 1], places[i]];
      this.shapes.push({ depth: (pair[0][2] + pair[1][2]) / 2 - nearer, places: pair, colour, width, dash });
    }
  }

  /** Add a triangle of a closed shape, if it looks towards the camera: anticlockwise as seen. */
  triangle(points, colour) {
    const places = points.map(this.project);
    const [[a, b], [c, d], [e, f]] = places;
    if ((c - a) * (f - b) - (d - b) * (e - a) >= 0) return;
    this.shapes.push({ depth: (places[0][2] + places[1][2] + places[2][2]) / 3, places, colour });
  }

  disc(point, radius, colour, border, depth = null) {
    const place = this.project(point);
    this.shapes.push({ depth: depth ?? place[2], places: [place], radius, colour, border });
  }

  paint() {
    this.shapes.sort((a, b) => b.depth - a.depth);
    for (const shape of this.shapes) this.paintShape(shape);
  }

  paintShape({ places, colour, width, dash, radius, border }) {
    const pen = this.context;
    pen.beginPath();
    if (radius) {
      pen.arc(places[0][0], places[0][1], radius, 0, 2 * Math.PI);
      pen.fillStyle = colour;
      pen.fill();
      pen.strokeStyle = border;
      pen.lineWidth = 1.5;
      pen.setLineDash([]);
      pen.stroke();
      return;
    }
    places.forEach(([x, y], i) => (i ? pen.lineTo(x, y) : pen.moveTo(x, y)));
    if (width) {
      pen.strokeStyle = colour;
      pen.lineWidth = width;
      pen.setLineDash(dash);
      pen.stroke();
      return;
    }
    pen.closePath();
    pen.fillStyle = colour;
    pen.fill();
    // Without a border in the same colour, the background shows between triangles.
    pen.setLineDash([]);
    pen.strokeStyle = colour;
    pen.lineWidth = 0.7;
    pen.stroke();
  }
}
