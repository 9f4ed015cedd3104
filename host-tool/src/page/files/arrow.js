// Draws the force, or each of two contacts, as an arrow on the film, seen from the tip's side, with
// the sensor's x, y and z.

/** Half the side of the drawn film, and the distance of its markers along x and y, mm. */
const FILM_MM = 5;
const MARKER_MM = 3.717;
/** Length of the longest arrow, mm on the film. */
const LONGEST_MM = 6;
/** Possible forces of the longest arrow, mN. */
const SCALES = [5, 10, 20, 30, 50, 70, 100, 150, 200, 300, 500, 700, 1000, 2000, 5000];
const START = { yaw: -0.5, pitch: 0.5 };
const TURN = 0.1;

export class Arrow {
  constructor(canvas, caption) {
    this.canvas = canvas;
    this.caption = caption;
    Object.assign(this, START);
    this.listen();
  }

  listen() {
    const { canvas } = this;
    canvas.addEventListener("pointerdown", (event) => canvas.setPointerCapture(event.pointerId));
    canvas.addEventListener("pointermove", (event) => {
      if (event.buttons & 1) this.turn(-event.movementX / 100, event.movementY / 100);
    });
    const keys = {
      ArrowLeft: [TURN, 0], ArrowRight: [-TURN, 0], ArrowUp: [0, TURN], ArrowDown: [0, -TURN],
    };
    canvas.addEventListener("keydown", (event) => {
      if (event.key === "0") Object.assign(this, START);
      const turn = keys[event.key];
      if (!turn) return;
      event.preventDefault();
      this.turn(...turn);
    });
  }

  turn(yaw, pitch) {
    this.yaw += yaw;
    this.pitch = Math.min(Math.PI / 2, Math.max(0.05, this.pitch + pitch));
  }

  /** Converts mm on the film to pixels of the canvas, without perspective. */
  project([x, y, z]) {
    const right = x * Math.cos(this.yaw) - y * Math.sin(this.yaw);
    const away = x * Math.sin(this.yaw) + y * Math.cos(this.yaw);
    const up = z * Math.cos(this.pitch) + away * Math.sin(this.pitch);
    return [this.middle[0] + right * this.perMm, this.middle[1] - up * this.perMm];
  }

  fit() {
    const { canvas } = this;
    const ratio = window.devicePixelRatio || 1;
    const [width, height] = [canvas.clientWidth, canvas.clientHeight];
    if (canvas.width !== Math.round(width * ratio)) canvas.width = Math.round(width * ratio);
    if (canvas.height !== Math.round(height * ratio)) canvas.height = Math.round(height * ratio);
    this.pen = canvas.getContext("2d");
    this.pen.setTransform(ratio, 0, 0, ratio, 0, 0);
    this.pen.clearRect(0, 0, width, height);
    this.perMm = Math.min(width / 15.5, height / 11.5);
    this.middle = [width / 2, height * 0.64];
    const style = getComputedStyle(canvas);
    this.colour = (name) => style.getPropertyValue(`--${name}`);
  }

  /**
   * `force`: mN, or null. `parts`: the two contacts that it is the sum of, or none. `largest`:
   * largest |F| of the last half minute; it sets the scale.
   */
  draw(force, parts, largest, frame) {
    this.fit();
    this.drawFilm();
    const scale = SCALES.find((scale) => scale >= largest) ?? SCALES.at(-1);
    this.caption.textContent = `longest arrow: ${scale} mN; drag to turn`;
    const { canvas } = this;
    if (!force) {
      canvas.dataset.shown = "";
      canvas.ariaLabel = "no force";
      return;
    }
    const each = parts.length > 0 ? parts : [force];
    const arrows = each.map((one) => ({ vector: one.vector, ...this.drawForce(one, scale) }));
    canvas.dataset.shown = JSON.stringify({ frame, ...arrows[0], others: arrows.slice(1) });
    canvas.ariaLabel = each.map((one) => `force ${one.magnitude.toFixed(0)} mN, ` +
      `α ${one.alpha.toFixed(0)}°, β ${one.beta.toFixed(0)}°`).join("; ");
  }

  /** Draws an arrow with its uncertainties; returns its ends on the canvas. */
  drawForce(force, scale) {
    const perMn = LONGEST_MM / scale;
    const { x = 0, y = 0, sigma = 0 } = force.place ?? {};
    const tail = [x, y, 0].map((at, axis) => at - force.vector[axis] * perMn);
    const across = force.directionSigma * Math.SQRT1_2 * Math.PI / 180;
    this.drawRound(tail, LONGEST_MM * force.magnitude / scale * across);
    this.drawRound([x, y, 0], sigma);
    const [from, to] = [tail, [x, y, 0]].map((point) => this.project(point));
    this.drawArrow(from, to);
    return { from, to };
  }

  line(points, colour, width = 1) {
    const { pen } = this;
    pen.beginPath();
    points.forEach((point) => pen.lineTo(...this.project(point)));
    pen.strokeStyle = colour;
    pen.lineWidth = width;
    pen.stroke();
  }

  drawFilm() {
    const faint = this.colour("line");
    for (let at = -FILM_MM; at <= FILM_MM; at += 1) {
      this.line([[at, -FILM_MM, 0], [at, FILM_MM, 0]], faint);
      this.line([[-FILM_MM, at, 0], [FILM_MM, at, 0]], faint);
    }
    for (const [x, y] of [[-1, -1], [1, -1], [1, 1], [-1, 1]]) {
      this.drawDot([x * MARKER_MM, y * MARKER_MM, 0]);
    }
    const axes = { x: [1, 0, 0], y: [0, 1, 0], z: [0, 0, 1] };
    for (const [name, axis] of Object.entries(axes)) {
      const end = axis.map((part) => part * (FILM_MM + 1));
      this.line([[0, 0, 0], end], this.colour(name));
      this.pen.fillStyle = this.colour(name);
      this.pen.fillText(name, ...this.project(end.map((part) => part * 1.07)));
    }
  }

  drawDot(point) {
    const { pen } = this;
    pen.fillStyle = this.colour("accent");
    pen.globalAlpha = 0.45;
    const flat = Math.max(0.15, Math.sin(this.pitch));
    pen.beginPath();
    pen.ellipse(...this.project(point), this.perMm / 2, this.perMm / 2 * flat, 0, 0, 7);
    pen.fill();
    pen.globalAlpha = 1;
  }

  /** Draws an uncertainty as a disc; `radius` in mm. */
  drawRound(point, radius) {
    const { pen } = this;
    pen.globalAlpha = 0.3;
    pen.fillStyle = this.colour("size");
    pen.beginPath();
    pen.arc(...this.project(point), Math.max(1, Math.min(radius, 9) * this.perMm), 0, 7);
    pen.fill();
    pen.globalAlpha = 1;
  }

  drawArrow(from, to) {
    const { pen } = this;
    const length = Math.hypot(to[0] - from[0], to[1] - from[1]);
    const angle = Math.atan2(to[1] - from[1], to[0] - from[0]);
    const head = Math.min(12, length);
    pen.strokeStyle = pen.fillStyle = this.colour("size");
    pen.lineWidth = 3;
    pen.beginPath();
    pen.moveTo(...from);
    pen.lineTo(to[0] - head * 0.8 * Math.cos(angle), to[1] - head * 0.8 * Math.sin(angle));
    pen.stroke();
    pen.beginPath();
    pen.moveTo(...to);
    for (const side of [-0.4, 0.4]) {
      pen.lineTo(to[0] - head * Math.cos(angle + side), to[1] - head * Math.sin(angle + side));
    }
    pen.fill();
  }
}
