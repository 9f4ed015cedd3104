// Shows sliders for the device's threshold. It sends their values as they move, one order at a
// time, always the newest values.

const HUE = 179;
const BYTE = 255;
const SLIDERS = {
  rgb565: [
    ["lowest hue", HUE], ["highest hue", HUE], ["lowest saturation", BYTE],
    ["highest saturation", BYTE], ["lowest value", BYTE], ["highest value", BYTE],
  ],
  yuv422: [["lowest Cr", BYTE]],
  mono: [["lowest luma", BYTE], ["highest luma", BYTE]],
};

export class Threshold {
  constructor(room, order) {
    this.room = room;
    this.order = order;
    this.format = null;
    this.inputs = [];
    this.waits = false;
    this.sends = false;
  }

  /** Shows the device's threshold, except while it is being changed here. */
  show({ format, limits }) {
    if (format !== this.format) this.build(format);
    if (this.sends) return;
    this.inputs.forEach(({ input, output }, number) => {
      if (document.activeElement === input && input.matches(":active")) return;
      input.value = limits[number];
      output.textContent = limits[number];
    });
  }

  build(format) {
    this.format = format;
    this.inputs = SLIDERS[format].map(([name, most]) => {
      const [label, input, output] = ["label", "input", "output"].map((tag) =>
        document.createElement(tag));
      Object.assign(input, { type: "range", min: 0, max: most, step: 1 });
      input.dataset.limit = name;
      input.addEventListener("input", () => {
        output.textContent = input.value;
        this.send();
      });
      label.append(name, input, output);
      return { label, input, output };
    });
    this.room.replaceChildren(...this.inputs.map(({ label }) => label));
  }

  limits() {
    const limits = this.inputs.map(({ input }) => Number(input.value));
    return [...limits, 0, 0, 0, 0, 0].slice(0, 6);
  }

  async send() {
    this.waits = true;
    if (this.sends) return;
    this.sends = true;
    while (this.waits) {
      this.waits = false;
      await this.order("threshold", { format: this.format, limits: this.limits() });
    }
    this.sends = false;
  }
}
