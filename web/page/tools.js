// The buttons of the page without a server: another sensor, or a picture of one's own.

import { paint, taken } from "./paint.js";
import { named } from "./sample.js";
import { open, whyNot } from "./serial.js";
import { updates } from "./update.js";

/** Most pixels of a side that the sensing takes; larger pictures are scaled down. */
const LARGEST_SIDE = 800;

const element = (tag, more, ...children) => {
  const made = Object.assign(document.createElement(tag), more);
  made.append(...children);
  return made;
};

/** Adds the buttons. */
export function offer({ connect, simulate, sense, ...forUpdates }) {
  const said = element("span", { role: "status", id: "said" });
  const say = (text) => {
    said.textContent = text;
  };
  let port = null;
  const on = (button, act) => {
    button.addEventListener("click", act);
    return button;
  };
  const button = (id, text) => element("button", { type: "button", id, textContent: text });
  const dots = element("select", { id: "dots" },
    ...[[4, "four dots"], [8, "eight dots"]].map(([value, text]) =>
      element("option", { value, textContent: text })));
  const simulated = async () => {
    say("");
    back.hidden = true;
    simulate(Number(dots.value));
    await port?.close();
    port = null;
  };
  dots.addEventListener("change", simulated);
  const back = on(button("simulate", "Simulated sensor"), simulated);
  back.hidden = true;
  const plug = on(button("connect", "Connect a sensor"), async () => {
    say(whyNot() ?? "");
    if (whyNot() !== null) return;
    try {
      await port?.close();
      port = await open(connect, say);
      back.hidden = false;
    } catch (error) {
      say(error.message);
    }
  });
  const file = element("input", { type: "file", accept: "image/*", id: "file" });
  const figure = element("figure", { className: "panel own", hidden: true });
  file.addEventListener("change", async () => {
    const [chosen] = file.files;
    if (!chosen) return;
    say("");
    try {
      show(figure, await sense(...await levels(chosen)), chosen.name);
    } catch (error) {
      say(`${chosen.name}: ${error.message}`);
    }
    // The same file can be chosen again, after it was changed.
    file.value = "";
  });
  const label = element("label", {}, "A picture of your own: ", file);
  const film = element("label", {}, "Simulated film: ", dots);
  const update = updates({ element, ...forUpdates });
  document.getElementById("tools").append(film, plug, back, label, said, update, figure);
}

/** Reads a picture: levels, width and height. */
async function levels(file) {
  let bitmap;
  try {
    bitmap = await createImageBitmap(file);
  } catch {
    throw new Error("this is no picture that the browser reads; save it as PNG or JPEG");
  }
  const scale = Math.min(1, LARGEST_SIDE / Math.max(bitmap.width, bitmap.height));
  const [width, height] = [bitmap.width, bitmap.height].map((side) =>
    Math.max(1, Math.round(side * scale)));
  const canvas = Object.assign(document.createElement("canvas"), { width, height });
  const pen = canvas.getContext("2d", { willReadFrequently: true });
  pen.drawImage(bitmap, 0, 0, width, height);
  return [pen.getImageData(0, 0, width, height).data, width, height];
}

/** Shows the sensing's result for a picture. */
function show(figure, bytes, name) {
  const end = bytes.indexOf(10);
  const { why, sample, lights } = JSON.parse(new TextDecoder().decode(bytes.subarray(0, end)));
  if (why !== undefined) throw new Error(why);
  const shown = taken(bytes.subarray(end + 1));
  const canvas = element("canvas", { role: "img", ariaLabel: name });
  paint(canvas, shown, true);
  const { told } = shown;
  const { force } = named(sample);
  const lines = [`${name}, ${told.width} × ${told.height} px, ${told.markers
    ? "four markers" : "no four markers"}`];
  if (force) {
    lines.push(`|F| ${force.magnitude.toFixed(1)} ± ${force.magnitudeSigma.toFixed(1)} mN, ` +
      `α ${force.alpha.toFixed(1)}°, β ${force.beta.toFixed(1)}°`);
  }
  lines.push(...lights.map(({ meaning, advice }) => advice ? `${meaning}: ${advice}` : meaning));
  lines.push(...told.wrong);
  const list = element("ul", {}, ...lines.map((line) => element("li", { textContent: line })));
  const close = element("button", { type: "button", textContent: "Close" });
  close.addEventListener("click", () => {
    figure.hidden = true;
  });
  figure.replaceChildren(canvas, element("figcaption", {}, list, close));
  figure.hidden = false;
  figure.dataset.shown = JSON.stringify({ name, markers: told.markers, force });
}
