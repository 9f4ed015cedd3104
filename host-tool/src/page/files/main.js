// Runs the page: one stream of events, one view for each sensor.

import { SensorView } from "./sensor.js";
import { listen } from "./source.js";

const link = document.getElementById("link");
const room = document.getElementById("sensors");
let views = [];

function begin(hello) {
  room.replaceChildren();
  document.getElementById("keys").hidden = !hello.obeys;
  views = Array.from({ length: hello.sensors }, (_, number) => {
    const view = new SensorView(number, hello);
    room.append(view.element);
    return view;
  });
  link.textContent = "";
}

/** The view that receives a key: the one with the focus, or the first. */
function chosen() {
  return views.find((view) => view.element.contains(document.activeElement)) ?? views[0];
}

document.addEventListener("keydown", (event) => {
  if (event.ctrlKey || event.metaKey || event.altKey || event.repeat) return;
  chosen()?.key(event.key.toLowerCase());
});

/** Twenty pictures a second look like motion; more would load the processor. */
const DRAW_EVERY_MS = 50;
let drawn = 0;
function draw(now) {
  if (now - drawn >= DRAW_EVERY_MS) {
    drawn = now;
    views.forEach((view) => view.draw(now));
  }
  requestAnimationFrame(draw);
}

listen({
  hello: begin,
  state: ({ sensor, state }) => views[sensor].state(state),
  truths: ({ sensor, truths }) => views[sensor].truths(truths),
  samples: ({ sensor, skipped, samples }) => views[sensor].samples(samples, skipped),
  gone: (why) => {
    link.textContent = why;
    views.forEach((view) => view.gone());
  },
});
requestAnimationFrame(draw);
