// Presses the film of a simulated sensor by mouse, pen, finger or keys, and shows the true press
// next to the sensor's answer for the same frame.

/** Half the side of the shown film, the largest distance of a press, the markers' distance, mm. */
const FILM_MM = 5;
const FARTHEST_MM = 4;
const MARKER_MM = 3.717;
/** Forces, mN: the largest, the first, and the step of wheel and keys. */
const MOST_MN = 250;
const FIRST_MN = 100;
const STEP_MN = 5;
/** Largest tilt, degrees, and degrees for each mm of the pointer with Shift. */
const STEEPEST_DEG = 12;
const DEG_PER_MM = 4;
const STEP_MM = 0.1;
/** Length of an arrow, mm for each mN. */
const MM_PER_MN = 0.02;
/** Number of frames whose true presses are kept. */
const KEPT = 512;
/** The pressure of a pointer that has none, such as a mouse's. */
const NO_PRESSURE = 0.5;

const limit = (value, most) => Math.max(-most, Math.min(most, value));

export class Press {
  constructor(part, order) {
    this.part = part;
    this.order = order;
    this.canvas = part("film");
    this.place = [0, 0];
    this.force = FIRST_MN;
    this.angles = [0, 0];
    this.pressed = false;
    /** The pointer that presses first, and the place of a second one. */
    this.first = null;
    this.second = null;
    this.truths = new Map();
    this.compared = null;
    this.listen();
  }

  listen() {
    const { canvas } = this;
    canvas.addEventListener("pointerdown", (event) => {
      canvas.setPointerCapture(event.pointerId);
      if (!this.pressed || this.first === null) this.first = event.pointerId;
      this.pressed = true;
      this.point(event);
    });
    canvas.addEventListener("pointermove", (event) => {
      // A mouse follows a press by keys without a button; it is no second finger.
      if (this.pressed && this.first === null) this.follow(event);
      else if (this.pressed && event.buttons !== 0) this.point(event);
    });
    for (const end of ["pointerup", "pointercancel"]) {
      canvas.addEventListener(end, (event) => this.lift(event));
    }
    canvas.addEventListener("wheel", (event) => {
      event.preventDefault();
      this.harder(event.deltaY < 0 ? STEP_MN : -STEP_MN);
    }, { passive: false });
    canvas.addEventListener("keydown", (event) => this.key(event));
    canvas.addEventListener("blur", () => this.release());
    window.addEventListener("pagehide", () => this.release());
  }

  /** The place of a pointer, mm. */
  placeOf(event) {
    const box = this.canvas.getBoundingClientRect();
    const at = (from, start, length) => ((from - start) / length * 2 - 1) * FILM_MM;
    return [at(event.clientX, box.left, box.width), at(event.clientY, box.top, box.height)];
  }

  /** Follows the first finger, or a second one that presses with the same force. */
  point(event) {
    if (event.pointerId === this.first) {
      this.follow(event);
      return;
    }
    if (this.second !== null && this.second.pointer !== event.pointerId) return;
    const place = this.placeOf(event).map((part) => limit(part, FARTHEST_MM));
    this.second = { pointer: event.pointerId, place };
    this.send();
  }

  /** Ends a finger's press: the second one's, or all. */
  lift(event) {
    if (event.pointerId === this.first) {
      this.release();
    } else if (this.second?.pointer === event.pointerId) {
      this.second = null;
      this.send();
    }
  }

  /** Takes place, force and tilt from a pointer. */
  follow(event) {
    const place = this.placeOf(event);
    if (event.shiftKey) {
      const tilt = place.map((part, axis) => (part - this.place[axis]) * DEG_PER_MM);
      this.angles = tilt.map((angle) => limit(angle, STEEPEST_DEG));
    } else {
      this.place = place.map((part) => limit(part, FARTHEST_MM));
    }
    const hasPressure = event.pointerType !== "mouse" && event.pressure > 0 &&
      event.pressure !== NO_PRESSURE;
    if (hasPressure) this.force = event.pressure * MOST_MN;
    this.send();
  }

  key(event) {
    const moves = {
      ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1],
    };
    const move = moves[event.key];
    if (move && event.shiftKey) {
      this.angles = this.angles.map((angle, axis) => limit(angle + move[axis], STEEPEST_DEG));
    } else if (move) {
      this.place = this.place.map((at, axis) => limit(at + STEP_MM * move[axis], FARTHEST_MM));
    } else if (event.key === "+") {
      this.force = Math.min(MOST_MN, this.force + STEP_MN);
    } else if (event.key === "-") {
      this.force = Math.max(0, this.force - STEP_MN);
    } else if (event.key === "0") {
      this.angles = [0, 0];
    } else if (event.key === " ") {
      this.pressed = !this.pressed;
      if (!this.pressed) this.release();
    } else {
      return;
    }
    event.preventDefault();
    event.stopPropagation();
    if (this.pressed) this.send();
  }

  harder(step) {
    this.force = Math.max(0, Math.min(MOST_MN, this.force + step));
    if (this.pressed) this.send();
  }

  release() {
    this.pressed = false;
    this.first = this.second = null;
    this.send();
  }

  /** Sends the hand's press; while an order is on its way, only the newest waits. */
  async send() {
    this.waits = true;
    if (this.sends) return;
    this.sends = true;
    while (this.waits) {
      this.waits = false;
      const press = [...this.place, this.force / 1e3, ...this.angles];
      const other = this.second && [...this.second.place, this.force / 1e3, ...this.angles];
      const both = other ? { press, other } : { press };
      await (this.pressed ? this.order("press", both) : this.order("release"));
    }
    this.sends = false;
  }

  /** Keeps the true presses of frames. */
  take(truths) {
    for (const [frame, [x, y, z, size], [alpha, beta], place] of truths) {
      this.truths.set(frame, {
        vector: [x / 1e3, y / 1e3, z / 1e3],
        magnitude: size / 1e3,
        alpha: alpha / 1e3,
        beta: beta / 1e3,
        place: place && { x: place[0] / 1e3, y: place[1] / 1e3 },
      });
      this.truths.delete(frame - KEPT);
    }
  }

  /** Compares a sample with the truth of its frame. */
  compare(sample) {
    const truth = this.truths.get(sample.frame);
    const { frame, force, parts } = sample;
    if (truth) this.compared = { frame, truth, force, parts };
  }

  draw() {
    this.drawFilm();
    if (this.compared === null) return;
    const { frame, truth, force } = this.compared;
    const row = (name, own, sensed, sigma, digits) => {
      const known = own !== undefined && own !== null;
      const both = known && sensed !== undefined && sensed !== null;
      this.say(`true-${name}`, known ? own.toFixed(digits) : "–");
      this.say(`off-${name}`, both
        ? `${(sensed - own).toFixed(digits)} (${(Math.abs(sensed - own) / sigma).toFixed(1)} σ)`
        : "–");
    };
    const angle = force && Math.max(force.directionSigma * Math.SQRT1_2, 1e-9);
    const pressed = truth.magnitude > 0;
    row("magnitude", truth.magnitude, force?.magnitude, force?.magnitudeSigma, 2);
    row("alpha", pressed ? truth.alpha : null, force?.alpha, angle, 2);
    row("beta", pressed ? truth.beta : null, force?.beta, angle, 2);
    row("place-x", truth.place?.x, force?.place?.x, force?.place?.sigma, 3);
    row("place-y", truth.place?.y, force?.place?.y, force?.place?.sigma, 3);
    this.part("truth").dataset.compared = JSON.stringify({ frame, truth, force });
  }

  say(name, text) {
    const part = this.part(name);
    if (part.textContent !== text) part.textContent = text;
  }

  drawFilm() {
    const { canvas } = this;
    const ratio = window.devicePixelRatio || 1;
    const side = canvas.clientWidth;
    const pixels = Math.round(side * ratio);
    if (canvas.width !== pixels) canvas.width = canvas.height = pixels;
    const pen = canvas.getContext("2d");
    pen.setTransform(ratio, 0, 0, ratio, 0, 0);
    pen.clearRect(0, 0, side, side);
    const style = getComputedStyle(canvas);
    this.pen = pen;
    this.colour = (name) => style.getPropertyValue(`--${name}`);
    this.at = ([x, y]) => [x, y].map((mm) => (mm / FILM_MM + 1) / 2 * side);
    pen.strokeStyle = this.colour("line");
    const corner = this.at([-FARTHEST_MM, -FARTHEST_MM]);
    pen.strokeRect(...corner, side - 2 * corner[0], side - 2 * corner[1]);
    for (const [x, y] of [[-1, -1], [1, -1], [1, 1], [-1, 1]]) {
      this.disc([x * MARKER_MM, y * MARKER_MM], 0.5, "accent");
    }
    const truth = this.compared?.truth;
    const force = this.compared?.force;
    if (truth?.place) this.arrow(truth.place, truth.vector, "good");
    const parts = this.compared?.parts ?? [];
    for (const one of parts.length > 0 ? parts : [force]) {
      if (one?.place && one.magnitude > 1) this.arrow(one.place, one.vector, "size");
    }
    const tilt = this.angles.some((angle) => angle !== 0)
      ? `, α ${this.angles[0].toFixed(0)}°, β ${this.angles[1].toFixed(0)}°` : "";
    this.say("hand", `${this.pressed ? "pressed with" : "press with"} ` +
      `${this.force.toFixed(0)} mN${tilt}`);
  }

  disc(place, radius, colour) {
    const { pen } = this;
    pen.fillStyle = this.colour(colour);
    pen.globalAlpha = 0.45;
    pen.beginPath();
    pen.arc(...this.at(place), this.at([radius, 0])[0] - this.at([0, 0])[0], 0, 7);
    pen.fill();
    pen.globalAlpha = 1;
  }

  /** A place with a disc whose area grows with the force, and the force's part along the film. */
  arrow({ x, y }, vector, colour) {
    const size = Math.hypot(...vector);
    this.disc([x, y], 0.1 + 0.05 * Math.sqrt(size), colour);
    const { pen } = this;
    pen.strokeStyle = this.colour(colour);
    pen.lineWidth = 2;
    pen.beginPath();
    pen.moveTo(...this.at([x, y]));
    pen.lineTo(...this.at([x + vector[0] * 5 * MM_PER_MN, y + vector[1] * 5 * MM_PER_MN]));
    pen.stroke();
  }
}
