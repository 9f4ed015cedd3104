// Shows one sensor: its numbers, lights, charts, arrow, picture and threshold.

import { Arrow } from "./arrow.js";
import { Chart } from "./chart.js";
import { Coverage } from "./coverage.js";
import { Picture } from "./picture.js";
import { Press } from "./press.js";
import { named } from "./sample.js";
import { Settings } from "./settings.js";
import { order } from "./source.js";
import { Threshold } from "./threshold.js";

/** Time for which a light stays on after its last sample, long enough to be read. */
const LIGHT_MS = 1500;
const CONTACT = 1 << 16;
const SLIP = 1 << 17;
const TWO_CONTACTS = 1 << 28;
/** The direction's uncertainty is that of an angle in a plane: √2 times that along one axis. */
const ONE_AXIS = Math.SQRT1_2;

/** Standard uncertainties of the components, from those along the force and across it. */
function sigmas({ vector, magnitude, magnitudeSigma, directionSigma }) {
  const across = magnitude * Math.min(directionSigma * ONE_AXIS * Math.PI / 180, 1);
  return vector.map((component) => {
    const along = magnitude > 0 ? component / magnitude : 0;
    return Math.hypot(along * magnitudeSigma, Math.sqrt(Math.max(0, 1 - along * along)) * across);
  });
}

export class SensorView {
  constructor(number, { lights, obeys, presses }) {
    const template = document.getElementById("sensor");
    this.element = template.content.firstElementChild.cloneNode(true);
    this.number = number;
    this.lights = lights;
    this.seen = new Map();
    this.newest = null;
    this.shift = 0;
    this.end = 0;
    this.trouble = null;
    this.arrow = new Arrow(this.part("arrow"), this.part("scale"));
    this.size = new Chart(this.part("size"), ["size"], true);
    this.components = new Chart(this.part("components"), ["x", "y", "z"], false);
    const obey = (what, more) => this.order(what, more);
    // A sensor that hivtac-calibrate records takes no orders.
    for (const name of ["buttons", "camera"]) this.part(name).hidden = !obeys;
    this.part("picture-on").checked = obeys;
    this.picture = new Picture(number, (name) => this.part(name));
    this.coverage = new Coverage((name) => this.part(name));
    this.threshold = new Threshold(this.part("sliders"), obey);
    this.settings = new Settings((name) => this.part(name), obey);
    this.part("truth").hidden = !presses;
    this.hand = presses ? new Press((name) => this.part(name), obey) : null;
    for (const button of this.element.querySelectorAll("[data-do]")) {
      button.addEventListener("click", () => this.press(button));
    }
  }

  part(name) {
    return this.element.querySelector(`[data-is="${name}"]`);
  }

  say(name, text) {
    const part = this.part(name);
    if (part.textContent !== text) part.textContent = text;
  }

  /** Sends an order to the device and shows the answer; returns true if it was done. */
  async order(what, more = {}) {
    const answer = await order(this.number, what, more);
    if (answer.text) this.say("answer", answer.text);
    return answer.done === true;
  }

  async press(button) {
    if (button.disabled) return;
    button.disabled = true;
    this.say("answer", "…");
    await this.order(button.dataset.do);
    button.disabled = false;
  }

  key(key) {
    if (this.part("buttons").hidden) return;
    if (key === "t") this.press(this.element.querySelector('[data-do="tare"]'));
    if (key === "r") this.press(this.part("record"));
    if (key === "p") this.part("picture-on").click();
    if (key === "m") this.part("mask-on").click();
  }

  samples(rows, skipped) {
    const now = performance.now();
    if (skipped > 0) this.say("answer", `this page was too slow for ${skipped} samples`);
    for (const row of rows) {
      const sample = named(row);
      this.place(sample);
      for (const light of this.lights) {
        if (sample.status & light.bit) this.seen.set(light.bit, now);
      }
      const { force } = sample;
      this.size.add(sample.shown, force && [force.magnitude], force && [force.magnitudeSigma]);
      this.components.add(sample.shown, force && force.vector, force && sigmas(force));
      this.newest = sample;
      this.hand?.compare(sample);
    }
  }

  /** Takes the true presses of a simulated sensor, which come before their samples. */
  truths(rows) {
    this.hand?.take(rows);
  }

  /** Sets a sample's time on the charts' axis, where a restarted device goes on after a gap. */
  place(sample) {
    let shown = sample.seconds + this.shift;
    if (shown < this.end) {
      this.shift = this.end + 0.5 - sample.seconds;
      shown = sample.seconds + this.shift;
    }
    this.end = shown;
    sample.shown = shown;
  }

  state(state) {
    this.trouble = state.trouble;
    this.element.classList.toggle("gone", state.trouble !== null);
    const called = state.name ? `${state.name} · ` : "";
    this.say("title", `${called}${state.board} · ${state.unit}`);
    this.say("facts", `${state.port} · ${state.firmware} · ${state.model ?? "no model"}`);
    this.say("rate", state.rate_hz === null ? "–" : state.rate_hz.toFixed(1));
    const causes = Object.entries(state.causes).filter(([, count]) => count > 0);
    const why = causes.map(([cause, count]) => `${cause} ${count}`).join(", ");
    this.say("lost", why ? `${state.lost} (${why})` : `${state.lost}`);
    this.say("latency", state.latency_us ? (state.latency_us / 1e3).toFixed(2) : "–");
    this.say("recording", state.recording.text);
    this.say("grip", state.grip ?? "");
    this.part("grip").hidden = !state.grip;
    this.say("record", state.recording.on ? "Stop recording" : "Record");
    this.part("record").dataset.do = state.recording.on ? "stop_recording" : "record";
    this.say("lines", state.lines.join("\n"));
    const model = state.model_threshold;
    this.say("model-threshold", model ? `the model's: ${model.text}` : "");
    this.threshold.show(state.threshold);
    this.settings.show(state);
    this.coverage.show(state.coverage);
  }

  gone() {
    this.trouble = "no connection to hivtac";
  }

  draw(now) {
    this.drawLights(now);
    const force = this.trouble === null ? this.newest?.force ?? null : null;
    this.drawNumbers(force);
    this.hand?.draw();
    this.size.draw(this.end);
    this.components.draw(this.end);
    const parts = force ? this.newest.parts : [];
    this.arrow.draw(force, parts, this.size.largest(), this.newest?.frame);
  }

  drawLights(now) {
    const on = this.lights.filter((light) => now - (this.seen.get(light.bit) ?? -1e9) < LIGHT_MS);
    const first = this.trouble === null
      ? { level: "good", meaning: "connected", advice: "" }
      : { level: "bad", meaning: this.trouble, advice: "" };
    const all = this.trouble === null ? [first, ...on] : [first];
    const text = JSON.stringify(all);
    if (text === this.lit) return;
    this.lit = text;
    this.part("lights").replaceChildren(...all.map((light) => {
      const item = document.createElement("li");
      item.className = light.level;
      item.dataset.light = light.name ?? "connection";
      item.textContent = light.meaning;
      if (light.advice) {
        const advice = document.createElement("span");
        advice.className = "advice";
        advice.textContent = `: ${light.advice}`;
        item.append(advice);
      }
      return item;
    }));
  }

  drawNumbers(force) {
    const show = (name, value, sigma, digits) => this.say(name, force && value !== undefined
      ? `${value.toFixed(digits)} ± ${sigma.toFixed(digits)}` : "–");
    const parts = force ? sigmas(force) : [];
    show("magnitude", force?.magnitude, force?.magnitudeSigma, 2);
    ["x", "y", "z"].forEach((name, axis) => show(name, force?.vector[axis], parts[axis], 2));
    const angle = force && force.directionSigma * ONE_AXIS;
    show("alpha", force?.alpha, angle, 2);
    show("beta", force?.beta, angle, 2);
    show("place-x", force?.place?.x, force?.place?.sigma, 3);
    show("place-y", force?.place?.y, force?.place?.sigma, 3);
    show("torque", force?.torque?.z, force?.torque?.sigma, 1);
    const has = (bit) => this.newest !== null && (this.newest.status & bit) !== 0;
    const touches = has(SLIP) ? "slips" : has(TWO_CONTACTS) ? "two" : has(CONTACT) ? "yes" : "no";
    this.say("contact", force ? touches : "–");
    this.part("numbers").dataset.frame = force ? this.newest.frame : "";
  }
}
