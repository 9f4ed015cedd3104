// Draws curves over the last half minute with bands of uncertainty. Memory is bounded: each column
// of time keeps only the least and the largest of its values.

const SECONDS = 30;
const COLUMNS = 600;
const PER_SECOND = COLUMNS / SECONDS;
/** Numbers of a curve in a column: least and largest value, and both with uncertainty. */
const KEPT = 4;
const LEFT = 44;
const BELOW = 16;

export class Chart {
  /** `names`: names of colours in the style sheet, one for each curve. */
  constructor(canvas, names, fromZero) {
    this.canvas = canvas;
    this.names = names;
    this.fromZero = fromZero;
    this.columns = new Float64Array(COLUMNS).fill(-1);
    this.values = new Float64Array(COLUMNS * names.length * KEPT);
  }

  slot(column, curve) {
    return ((column % COLUMNS) * this.names.length + curve) * KEPT;
  }

  /** Adds values at a time, s, with their standard uncertainties; null leaves a gap. */
  add(seconds, values, sigmas) {
    if (values === null) return;
    const column = Math.floor(seconds * PER_SECOND);
    const isNew = this.columns[column % COLUMNS] !== column;
    this.columns[column % COLUMNS] = column;
    values.forEach((value, curve) => {
      const at = this.slot(column, curve);
      const all = [value, value, value - sigmas[curve], value + sigmas[curve]];
      all.forEach((one, kept) => {
        const before = isNew ? one : this.values[at + kept];
        this.values[at + kept] = (kept % 2 ? Math.max : Math.min)(before, one);
      });
    });
  }

  /** The columns of the last half minute that have values. */
  *filled(end = this.end) {
    const last = Math.floor(end * PER_SECOND);
    for (let column = Math.max(0, last - COLUMNS + 1); column <= last; column += 1) {
      if (this.columns[column % COLUMNS] === column) yield column;
    }
  }

  /** The largest absolute value. */
  largest() {
    let largest = 0;
    for (const column of this.filled(this.end ?? 0)) {
      for (let curve = 0; curve < this.names.length; curve += 1) {
        const at = this.slot(column, curve);
        largest = Math.max(largest, -this.values[at], this.values[at + 1]);
      }
    }
    return largest;
  }

  range() {
    let [low, high] = this.fromZero ? [0, 1] : [-1, 1];
    for (const column of this.filled()) {
      for (let curve = 0; curve < this.names.length; curve += 1) {
        const at = this.slot(column, curve);
        low = Math.min(low, this.values[at + 2]);
        high = Math.max(high, this.values[at + 3]);
      }
    }
    const step = niceStep((high - low) / 4);
    return { low: Math.floor(low / step) * step, high: Math.ceil(high / step) * step, step };
  }

  draw(end) {
    this.end = end;
    const { canvas } = this;
    const ratio = window.devicePixelRatio || 1;
    const [width, height] = [canvas.clientWidth, canvas.clientHeight];
    if (canvas.width !== Math.round(width * ratio)) canvas.width = Math.round(width * ratio);
    if (canvas.height !== Math.round(height * ratio)) canvas.height = Math.round(height * ratio);
    const pen = canvas.getContext("2d");
    pen.setTransform(ratio, 0, 0, ratio, 0, 0);
    pen.clearRect(0, 0, width, height);
    const range = this.range();
    const style = getComputedStyle(canvas);
    const begin = end - SECONDS;
    const place = {
      x: (seconds) => LEFT + (seconds - begin) / SECONDS * (width - LEFT - 4),
      y: (value) => 5 + (range.high - value) / (range.high - range.low) * (height - BELOW - 5),
    };
    this.drawAxes(pen, style, place, range, end);
    this.names.forEach((name, curve) => {
      this.drawCurve(pen, style.getPropertyValue(`--${name}`), place, curve);
    });
  }

  drawAxes(pen, style, place, { low, high, step }, end) {
    pen.strokeStyle = style.getPropertyValue("--line");
    pen.fillStyle = style.getPropertyValue("--faint");
    pen.lineWidth = 1;
    pen.textAlign = "right";
    pen.textBaseline = "middle";
    const digits = Math.max(0, -Math.floor(Math.log10(step)));
    for (let value = low; value < high + step / 2; value += step) {
      pen.fillText(value.toFixed(digits), LEFT - 5, place.y(value));
      rule(pen, [place.x(end - SECONDS), place.y(value)], [place.x(end), place.y(value)]);
    }
    pen.textAlign = "center";
    for (let ago = 0; ago <= SECONDS; ago += 10) {
      const text = ago === 0 ? "now" : `−${ago} s`;
      const x = place.x(end - ago);
      pen.fillText(text, Math.min(x, place.x(end) - 10), place.y(low) + 9);
      rule(pen, [x, place.y(low)], [x, place.y(high)]);
    }
  }

  /** Draws a band and a line, with gaps where values are missing for over half a second. */
  drawCurve(pen, colour, place, curve) {
    let part = [];
    for (const column of this.filled()) {
      if (part.length > 0 && column - part.at(-1) > PER_SECOND / 2) {
        this.drawPart(pen, colour, place, curve, part);
        part = [];
      }
      part.push(column);
    }
    this.drawPart(pen, colour, place, curve, part);
  }

  drawPart(pen, colour, place, curve, columns) {
    const x = (column) => place.x((column + 0.5) / PER_SECOND);
    const y = (column, kept) => place.y(this.values[this.slot(column, curve) + kept]);
    pen.fillStyle = pen.strokeStyle = colour;
    pen.globalAlpha = 0.25;
    pen.beginPath();
    columns.forEach((column) => pen.lineTo(x(column), y(column, 2)));
    for (let n = columns.length - 1; n >= 0; n -= 1) {
      pen.lineTo(x(columns[n]), y(columns[n], 3));
    }
    pen.fill();
    pen.globalAlpha = 1;
    pen.lineWidth = 1.5;
    pen.beginPath();
    columns.forEach((column) => {
      pen.lineTo(x(column), y(column, 0));
      pen.lineTo(x(column), y(column, 1));
    });
    pen.stroke();
  }
}

function rule(pen, from, to) {
  pen.beginPath();
  pen.moveTo(...from);
  pen.lineTo(...to);
  pen.stroke();
}

/** The least number of the form 1, 2 or 5 times a power of ten that is not below `least`. */
function niceStep(least) {
  const power = 10 ** Math.floor(Math.log10(least));
  return [1, 2, 5, 10].map((n) => n * power).find((step) => step >= least * 0.999);
}
