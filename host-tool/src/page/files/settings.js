// Sets the contact's shape, and shows the one in use.

const HAS_RADIUS = ["round", "flat"];

export class Settings {
  constructor(part, order) {
    this.part = part;
    this.order = order;
    for (const name of ["shape", "radius"]) {
      part(name).addEventListener("change", () => this.send());
    }
  }

  send() {
    const shape = this.part("shape").value;
    const hasRadius = HAS_RADIUS.includes(shape);
    this.part("radius-of").hidden = !hasRadius;
    const contact = hasRadius ? `${shape}:${this.part("radius").value}` : shape;
    this.order("contact", { contact });
  }

  /** Shows the shape in use, except while it is being chosen here. */
  show({ contact }) {
    const text = contact === null ? "" : `in use: ${contact}`;
    if (this.part("contact-in-use").textContent === text) return;
    this.part("contact-in-use").textContent = text;
    const shape = contact?.split(/[ ,]/)[0];
    if (shape && document.activeElement !== this.part("shape")) this.part("shape").value = shape;
  }
}
