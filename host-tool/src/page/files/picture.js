// Shows the camera's picture with mask and markers. It requests a picture after it has shown the
// one before, and a slow page therefore requests few.

import { paint, taken } from "./paint.js";
import { picture } from "./source.js";

const PAUSE_MS = 200;
const AFTER_FAILURE_MS = 2000;

const wait = (ms) => new Promise((done) => setTimeout(done, ms));

export class Picture {
  constructor(number, part) {
    this.number = number;
    this.part = part;
    this.shown = null;
    part("mask-on").addEventListener("change", () => this.draw());
    part("picture-on").addEventListener("change", () => this.follow());
    part("save").addEventListener("click", () => this.save());
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
    const { text, bytes } = await picture(this.number);
    if (bytes === undefined) return text;
    this.shown = taken(bytes);
    this.draw();
    return null;
  }

  draw() {
    if (this.shown === null) return;
    const { told, mask } = this.shown;
    paint(this.part("picture"), this.shown, this.part("mask-on").checked);
    this.tell(told, mask.length);
  }

  /** Saves what the camera saw, without mask and markers. */
  save() {
    if (this.shown === null) return;
    const canvas = document.createElement("canvas");
    paint(canvas, { ...this.shown, told: { ...this.shown.told, markers: null } }, false);
    const link = document.createElement("a");
    link.download = `hivtac-frame-${this.shown.told.frame}.png`;
    link.href = canvas.toDataURL("image/png");
    link.click();
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
