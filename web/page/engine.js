// The worker: runs the WebAssembly module, so that the page stays quick while frames are sensed.

"use strict";

/** Time between two deliveries of events: thirty a second look like motion on a screen. */
const TELL_EVERY_MS = 33;

let module = null;
let told = 0;
let timer = null;

const start = performance.now();
const nowUs = () => (performance.now() - start) * 1e3;
const epochMs = () => performance.timeOrigin + start;

/** A copy of bytes that the module put out. */
function taken(length) {
  return new Uint8Array(module.memory.buffer, module.taken(), length).slice();
}

const textOf = (length) => new TextDecoder().decode(taken(length));

/** Puts bytes in for the next call. */
function put(bytes) {
  const at = module.reserve(bytes.length);
  new Uint8Array(module.memory.buffer, at, bytes.length).set(bytes);
}

const putText = (text) => put(new TextEncoder().encode(text));

/** Unpacks a file of gzip. */
const unpacked = (bytes) =>
  new Response(new Blob([bytes]).stream().pipeThrough(new DecompressionStream("gzip")))
    .arrayBuffer();

async function load(bytes) {
  const page = {
    now_us: nowUs,
    stopped: (length) => postMessage({ stopped: textOf(length) }),
  };
  const { instance } = await WebAssembly.instantiate(await unpacked(bytes), { page });
  module = instance.exports;
  simulate({ dots: 4 });
}

function simulate({ dots }) {
  const length = module.simulate(dots, epochMs());
  if (length > 0) postMessage({ stopped: textOf(length) });
}

/** Delivers events, with the bytes that they announce, and the bytes for a device. */
function tell() {
  const sent = module.sent();
  if (sent > 0) postMessage({ send: taken(sent) });
  if (performance.now() - told < TELL_EVERY_MS) return;
  told = performance.now();
  const events = JSON.parse(textOf(module.events()));
  for (const [name, data] of events) {
    if (name === "picture" || name === "file") data.bytes = taken(module.blob());
  }
  if (events.length > 0) postMessage({ events });
}

/** One turn after the other. */
function turn() {
  try {
    const waitUs = module.turn();
    tell();
    timer = setTimeout(turn, waitUs / 1e3);
  } catch (error) {
    fail(error);
  }
}

/** Summed samples, and how many frames a second they took. */
function summed({ camera, frames }) {
  const begun = performance.now();
  const sum = module.sum(camera, frames);
  const seconds = (performance.now() - begun) / 1e3;
  return {
    crc: Number(sum & 0xffffffffn), forces: Number(sum >> 32n), perSecond: frames / seconds,
  };
}

/** After a panic the module cannot go on. */
function fail(error) {
  clearTimeout(timer);
  postMessage({ stopped: String(error) });
}

const ACTS = {
  simulate,
  connect: ({ name }) => {
    putText(name);
    module.connect(epochMs());
  },
  receive: ({ bytes }) => {
    put(bytes);
    module.receive();
  },
  lost: ({ why }) => {
    putText(why);
    module.lost();
  },
  order: ({ ticket, body }) => {
    putText(body);
    module.order(ticket);
  },
  picture: ({ ticket }) => module.picture(ticket),
  sense: ({ ticket, levels, width, height }) => {
    put(levels);
    const bytes = taken(module.sense(width, height));
    postMessage({ events: [["sensed", { ticket, bytes }]] });
  },
  firmware: ({ ticket, bytes }) => {
    put(bytes);
    const told = JSON.parse(textOf(module.firmware()));
    postMessage({ events: [["firmware", { ticket, told }]] });
  },
  firmwareParts: ({ ticket, bytes }) => {
    put(bytes);
    const all = taken(module.firmware_parts());
    const end = all.indexOf(10);
    const told = JSON.parse(new TextDecoder().decode(all.subarray(0, end)));
    postMessage({ events: [["firmware", { ticket, told, bytes: all.slice(end + 1) }]] });
  },
  startLoader: ({ ticket }) => module.start_loader(ticket),
  sum: (asked) => postMessage({ events: [["summed", { ticket: asked.ticket, ...summed(asked) }]] }),
};

/** Resolved once the module is there: what the page asks before waits. */
let loaded = null;

onmessage = async ({ data }) => {
  try {
    if (data.act === "load") {
      loaded = load(data.bytes);
      await loaded;
      turn();
      return;
    }
    await loaded;
    ACTS[data.act](data);
    tell();
  } catch (error) {
    fail(error);
  }
};
