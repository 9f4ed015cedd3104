// New firmware for a sensor: a file, the sensor's restart into its loader, and the writing.

import { openLoader, whyNot } from "./dfu.js";
import { bytesOf } from "./packed.js";

/** Address of the flash: the device starts from there. */
const FLASH = 0x08000000;
const AGAIN = "choose the loader and write again: the sensor waits in its loader";

/** The bytes of each part, behind one another. */
function divided(parts, bytes) {
  let from = 0;
  return parts.map(([address, length]) => {
    from += length;
    return [address, bytes.subarray(from - length, from)];
  });
}

/** Writes and reads back; `say` reports its progress. */
async function write(loader, look, firmwareParts, say) {
  const { why, parts, bytes } = await firmwareParts(await loader.read(FLASH, look));
  if (why !== undefined) throw new Error(`the sensor in its loader is another one: ${why}`);
  const all = divided(parts, bytes);
  let written = 0;
  for (const [address, part] of all) {
    await loader.fill(address, part, (count) => {
      written += count;
      say(`${Math.round(written / 1000)} of ${Math.round(bytes.length / 1000)} kB written`);
    });
  }
  say("reading back");
  for (const [address, part] of all) {
    const found = await loader.read(address, part.length);
    const differs = part.findIndex((byte, at) => byte !== found[at]);
    if (differs >= 0) {
      const at = (address + differs).toString(16).padStart(8, "0");
      throw new Error(`the sensor kept other bytes than it was sent, the first at 0x${at}; ${AGAIN}`);
    }
  }
  await loader.leave(FLASH);
}

/** Unpacks a file of gzip that the page carries as text. */
function carried(text) {
  const stream = new Blob([bytesOf(text)]).stream().pipeThrough(new DecompressionStream("gzip"));
  return new Response(stream).arrayBuffer();
}

/** The panel for firmware. */
export function updates({ element, firmware, firmwareParts, startLoader }) {
  const said = element("span", { role: "status", id: "flashed" });
  const say = (text) => {
    said.textContent = text;
  };
  let chosen = null;
  const button = (id, textContent) =>
    element("button", { type: "button", id, textContent, disabled: true });
  const restart = button("restart", "1. Restart the sensor into its loader");
  const flash = button("flash", "2. Choose the loader and write");
  const file = element("input", { type: "file", id: "image" });
  const choose = async (name, buffer) => {
    chosen = await firmware(new Uint8Array(buffer));
    const { why, board, version } = chosen;
    say(`${name}: ${why ?? `firmware ${version} for ${board}`}`);
    restart.disabled = why !== undefined;
    flash.disabled = why !== undefined;
  };
  file.addEventListener("change", async () => {
    const [given] = file.files;
    if (given) await choose(given.name, await given.arrayBuffer());
    file.value = "";
  });
  const own = Object.entries(globalThis.FIRMWARE).map(([board, text]) => {
    const it = element("button", { type: "button", textContent: `This page's for ${board}` });
    it.addEventListener("click", async () => choose("this page's", await carried(text)));
    return it;
  });
  restart.addEventListener("click", async () => {
    const { done, text } = await startLoader();
    say(done ? "the sensor is in its loader; keep it plugged in" : `not restarted: ${text}; ` +
      "if it is in its loader already, go on");
  });
  flash.addEventListener("click", async () => {
    say(whyNot() ?? "");
    if (whyNot() !== null) return;
    flash.disabled = true;
    let loader = null;
    try {
      loader = await openLoader();
      await write(loader, chosen.look, firmwareParts, say);
      say(`firmware ${chosen.version} written, and every byte read back; connect the sensor`);
    } catch (error) {
      const gone = error.name === "NetworkError" || error.name === "NotFoundError";
      say(gone ? `the connection was lost; ${AGAIN}` : error.message);
      await loader?.close();
    }
    flash.disabled = false;
  });
  const label = element("label", {}, "A release's .bin, or an ELF: ", file);
  const choice = element("p", {}, ...own, label);
  return element("details", { id: "firmware" },
    element("summary", { textContent: "New firmware" }), choice, restart, flash, said);
}
