// Where the page's data comes from, and where its orders go: the WebAssembly module in a worker. It
// simulates a sensor, or talks with a device whose bytes this page brings.

import { bytesOf } from "./packed.js";
import { offer } from "./tools.js";

/** Handlers of the page; answers that are awaited, by their tickets; and the open device. */
let handlers = {};
const awaited = new Map();
let tickets = 0;
let worker = null;
let device = null;

function post(act, more = {}, transfer = []) {
  worker.postMessage({ act, ...more }, transfer);
}

/** Asks the worker; the answer is the event with this ticket. */
function ask(act, more, transfer) {
  tickets += 1;
  const ticket = tickets;
  return new Promise((answer) => {
    awaited.set(ticket, answer);
    post(act, { ticket, ...more }, transfer);
  });
}

function answer(data) {
  awaited.get(data.ticket)?.(data);
  awaited.delete(data.ticket);
}

function stop(why) {
  handlers.gone(`the sensing in this page has stopped (${why}): load the page again`);
  for (const ticket of [...awaited.keys()]) answer({ ticket, text: "the sensing has stopped" });
}

const EVENTS = {
  answer,
  picture: answer,
  sensed: answer,
  summed: answer,
  firmware: answer,
  file: ({ name, bytes }) => save(name, bytes),
  lost: ({ text }) => device?.close(text),
};

/** Offers bytes as a file. */
function save(name, bytes) {
  const link = document.createElement("a");
  link.download = name;
  link.href = URL.createObjectURL(new Blob([bytes], { type: "application/octet-stream" }));
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 60_000);
}

function take({ data }) {
  if (data.stopped !== undefined) stop(data.stopped);
  if (data.send !== undefined) device?.send(data.send);
  for (const [name, told] of data.events ?? []) (EVENTS[name] ?? handlers[name])?.(told);
}

/** Starts the worker from what is in the page, without a request: pages on disk may make none. */
export function listen(ours) {
  handlers = ours;
  const { module, engine } = globalThis.HIVTAC;
  worker = new Worker(URL.createObjectURL(new Blob([engine], { type: "text/javascript" })));
  worker.onmessage = take;
  worker.onerror = (event) => stop(event.message);
  const bytes = bytesOf(module).buffer;
  post("load", { bytes }, [bytes]);
  offer({ connect, simulate, sense, firmware, firmwareParts, startLoader });
  // For tests and measurements: the sums of a camera's frames.
  globalThis.HIVTAC.sum = (camera, frames) => ask("sum", { camera, frames });
}

export const order = (sensor, what, more) =>
  ask("order", { body: JSON.stringify({ sensor, order: what, ...more }) });

export const picture = () => ask("picture");

/** Senses levels of red, green, blue and opacity. */
const sense = (levels, width, height) =>
  ask("sense", { levels, width, height }, [levels.buffer]).then(({ bytes }) => bytes);

/** Checks a file of firmware: `board`, `version`, `look`; or `why` not. */
const firmware = (bytes) => ask("firmware", { bytes }, [bytes.buffer]).then(({ told }) => told);

/** The parts to write into a device whose flash begins so: `parts` and `bytes`; or `why` not. */
const firmwareParts = (bytes) =>
  ask("firmwareParts", { bytes }, [bytes.buffer]).then(({ told, bytes: all }) => ({
    ...told, bytes: all,
  }));

const startLoader = () => ask("startLoader");

/** Shows a device, which has `name`, `send` and `close`; returns its identity. */
function connect(next) {
  device = next;
  post("connect", { name: next.name });
  return {
    receive: (bytes) => device === next && post("receive", { bytes }, [bytes.buffer]),
    lost: (why) => device === next && post("lost", { why }),
  };
}

/** Shows a simulated sensor with this number of dots. */
function simulate(dots) {
  device = null;
  post("simulate", { dots });
}
