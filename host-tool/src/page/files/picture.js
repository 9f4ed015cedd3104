// Shows the camera's picture with mask and markers. It requests a picture after it has shown the
// one before, and a slow page therefore requests few.

const PAUSE_MS = 200;
const AFTER_FAILURE_MS = 2000;
const PASSED = 255;

const wait = (ms) => new Promise((done) => setTimeout(done, ms));

/** Splits bytes into the line of JSON, the levels and the mask. */
function taken(bytes) {
  const end = bytes.indexOf(10);
  const told = JSON.parse(new TextDecoder().decode(bytes.subarray(0, end)));
  const pixels = told.width * told.height;
  const levels = bytes.subarray(end + 1, end + 1 + 3 * pixels);
  return { told, levels, mask: bytes.subarray(end + 1 + 3 * pixels) };
}

export class Picture {
  constructor(number, part) {
    this.number = number;
    this.part = part;
    this.shown = null;
    part("mask-on").addEventListener("change", () => this.draw());
    part("picture-on").addEventListener("change", () => this.follow());
    // The first picture, once the page is complete.
    setTimeout(() => this.follow());
  }

  async follow() {
    if (this.runs) return;
    this.runs = true;
    while (this.part("picture-on").checked && this.part("picture").isConnected) {
      const why = await this.next();
      if (why) this.part("wrong").textContent = `no picture: ${why}`;
      await wait(why ? AFTER_FAILURE_MS : PAUSE_MS);
    }
    this.runs = false;
  }

  /** Shows the next picture; returns null, or the reason for a missing picture. */
  async next() {
    try {
      const response = await fetch(`picture/${this.number}`);
      if (!response.ok) return await response.text();
      if (response.headers.get("content-type") === "application/json") {
        return (await response.json()).text;
      }
      this.shown = taken(new Uint8Array(await response.arrayBuffer()));
      this.draw();
      return null;
    } catch {
      return "nothing answers";
    }
  }

  draw() {
    if (this.shown === null) return;
    const { told, levels, mask } = this.shown;
    const canvas = this.part("picture");
    canvas.width = told.width;
    canvas.height = told.height;
    const pen = canvas.getContext("2d");
    const image = pen.createImageData(told.width, told.height);
    const isMask = this.part("mask-on").checked;
    for (let pixel = 0; pixel < mask.length; pixel += 1) {
      const strength = !isMask || mask[pixel] === 0 ? 0 : mask[pixel] === PASSED ? 0.6 : 0.3;
      const tint = [0, 255, 255];
      for (let c = 0; c < 3; c += 1) {
        image.data[4 * pixel + c] =
          levels[3 * pixel + c] * (1 - strength) + tint[c] * strength;
      }
      image.data[4 * pixel + 3] = 255;
    }
    pen.putImageData(image, 0, 0);
    this.drawMarkers(pen, told.markers ?? []);
    this.tell(told, mask.length);
  }

  drawMarkers(pen, markers) {
    pen.strokeStyle = pen.fillStyle = "#ffff00";
    for (const { id, x, y } of markers) {
      pen.beginPath();
      pen.moveTo(x - 5, y);
      pen.lineTo(x + 6, y);
      pen.moveTo(x + 0.5, y - 5);
      pen.lineTo(x + 0.5, y + 6);
      pen.stroke();
      pen.fillText(id, x + 8, y - 8);
    }
  }

  tell(told, pixels) {
    const share = (100 * told.passed / pixels).toFixed(2);
    this.part("share").textContent = `${share} % of the pixels pass`;
    this.part("wrong").textContent = told.wrong.join("\n");
    const { dataset } = this.part("picture");
    dataset.frame = told.frame;
    dataset.passed = told.passed;
    dataset.limits = told.threshold.limits.join(",");
  }
}
