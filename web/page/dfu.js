// The microcontroller's own loader, by WebUSB: DFU with ST's extensions (DfuSe, AN3156).

/** The loader's identity on USB. */
const LOADER = { vendorId: 0x0483, productId: 0xdf11 };
/** Class and subclass of an interface for DFU, and the protocol of one in its loader. */
const DFU = [0xfe, 1, 2];
/** The flash of an STM32H743 begins so: sectors of 128 KiB. */
const FLASH = /^@Internal Flash *\/0x08000000\/\d+\*128K/;
/** Requests. */
const [DOWNLOAD, UPLOAD, GET_STATUS, CLEAR_STATUS, ABORT] = [1, 2, 3, 4, 6];
/** States. */
const [IDLE, SYNC, BUSY, DOWNLOAD_IDLE, ERROR] = [2, 3, 4, 5, 10];
/** Number of the block with commands, and of the block at the address. */
const [COMMANDS, FIRST_BLOCK] = [0, 2];
/** Commands, each followed by an address. */
const [SET_ADDRESS, ERASE] = [0x21, 0x41];
/** Types of the descriptors of a configuration, and of DFU's functions. */
const [CONFIGURATION, FUNCTIONAL] = [2, 0x21];
/** Most attempts to make the loader idle, and most looks for the end of a command. */
const [ATTEMPTS, LOOKS] = [4, 200];
/** Bytes of a flash word: blocks are whole ones. */
const WORD_BYTES = 32;
const LONGEST_PAUSE_MS = 5000;

/** Why this page cannot write firmware; null if it can. */
export function whyNot() {
  if ("usb" in navigator) return null;
  if (!window.isSecureContext) {
    return "a page from another computer may use USB only over https: open this page by https, " +
      "from localhost, or as a file on this computer";
  }
  return "this browser has no WebUSB: use a current Chrome or Edge on a computer, or " +
    "`hivtac update firmware`";
}

const pause = (ms) => new Promise((go) => setTimeout(go, Math.min(ms, LONGEST_PAUSE_MS)));

/** Cause and remedy when the loader cannot be opened. */
function refused(error) {
  const advice = {
    NotFoundError: "no loader was chosen; if none is listed: restart the sensor into its loader " +
      "first, or hold BOOT0 during reset",
    SecurityError: "the loader cannot be opened: on Linux install the udev rule, on Windows the " +
      "driver WinUSB for it, and end other programs that use it",
    NetworkError: "the loader cannot be opened: another program may hold it; end that, and try again",
  };
  return new Error(advice[error.name] ?? error.message);
}

/** The interface of the flash, as [number, alternate]. */
function flashOf(configuration) {
  for (const { interfaceNumber, alternates } of configuration?.interfaces ?? []) {
    for (const it of alternates) {
      const is = [it.interfaceClass, it.interfaceSubclass, it.interfaceProtocol];
      if (is.every((number, at) => number === DFU[at]) && FLASH.test(it.interfaceName ?? "")) {
        return [interfaceNumber, it.alternateSetting];
      }
    }
  }
  throw new Error("this is not the loader of an STM32H743, whose flash has sectors of 128 KiB");
}

/** Opens the loader that the user chooses. */
export async function openLoader() {
  try {
    const device = await navigator.usb.requestDevice({ filters: [LOADER] });
    await device.open();
    if (device.configuration === null) await device.selectConfiguration(1);
    const [number, alternate] = flashOf(device.configuration);
    await device.claimInterface(number);
    await device.selectAlternateInterface(number, alternate);
    const loader = new Loader(device, number);
    await loader.begin();
    return loader;
  } catch (error) {
    throw refused(error);
  }
}

class Loader {
  constructor(device, number) {
    this.device = device;
    this.number = number;
    this.blockBytes = 0;
  }

  async begin() {
    const setup = {
      requestType: "standard", recipient: "device", request: 6, value: CONFIGURATION << 8, index: 0,
    };
    const { data } = await this.device.controlTransferIn(setup, 4096);
    for (let at = 0; at + 7 <= data.byteLength && data.getUint8(at) > 0; at += data.getUint8(at)) {
      if (data.getUint8(at + 1) === FUNCTIONAL) this.blockBytes = data.getUint16(at + 5, true);
    }
    this.blockBytes -= this.blockBytes % WORD_BYTES;
    if (this.blockBytes === 0) throw new Error("the loader does not say how much it takes at once");
    await this.makeIdle();
  }

  setup(request, value) {
    return { requestType: "class", recipient: "interface", request, value, index: this.number };
  }

  async send(request, value, bytes = new Uint8Array()) {
    const { status } = await this.device.controlTransferOut(this.setup(request, value), bytes);
    if (status !== "ok") throw new Error(`the loader refused request ${request} (${status})`);
  }

  async fetch(request, value, length) {
    const answer = await this.device.controlTransferIn(this.setup(request, value), length);
    const came = answer.data?.byteLength ?? 0;
    if (answer.status !== "ok" || came !== length) {
      throw new Error(`the loader sent ${came} of ${length} bytes (${answer.status})`);
    }
    return new Uint8Array(answer.data.buffer, answer.data.byteOffset, length);
  }

  async status() {
    const [status, low, middle, high, state] = await this.fetch(GET_STATUS, 0, 6);
    return { status, state, ms: low | (middle << 8) | (high << 16) };
  }

  async makeIdle() {
    for (let attempt = 0; attempt < ATTEMPTS; attempt += 1) {
      const { state, ms } = await this.status();
      if (state === IDLE) return;
      if (state === BUSY) await pause(ms);
      else await this.send(state === ERROR ? CLEAR_STATUS : ABORT, 0);
    }
    throw new Error("the loader does not become idle: take the sensor off its supply, and try again");
  }

  /** Waits until the loader has finished a request. */
  async settle() {
    for (let look = 0; look < LOOKS; look += 1) {
      const { status, state, ms } = await this.status();
      if (state === IDLE || state === DOWNLOAD_IDLE) return;
      if (state !== SYNC && state !== BUSY) {
        await this.makeIdle().catch(() => {});
        throw new Error(`the loader refused: status ${status}, state ${state}`);
      }
      await pause(ms);
    }
    throw new Error("the loader does not finish");
  }

  async command(command, address) {
    const bytes = new DataView(new ArrayBuffer(5));
    bytes.setUint8(0, command);
    bytes.setUint32(1, address, true);
    await this.send(DOWNLOAD, COMMANDS, new Uint8Array(bytes.buffer));
    await this.settle();
  }

  /** Erases the sector at an address, and writes bytes to its begin; `each` gets their count. */
  async fill(address, bytes, each) {
    await this.command(ERASE, address);
    for (let at = 0; at < bytes.length; at += this.blockBytes) {
      const block = bytes.slice(at, at + this.blockBytes);
      await this.command(SET_ADDRESS, address + at);
      await this.send(DOWNLOAD, FIRST_BLOCK, block);
      await this.settle();
      each(block.length);
    }
  }

  async read(address, length) {
    const bytes = new Uint8Array(length);
    for (let at = 0; at < length; at += this.blockBytes) {
      await this.command(SET_ADDRESS, address + at);
      await this.makeIdle();
      const block = await this.fetch(UPLOAD, FIRST_BLOCK, Math.min(this.blockBytes, length - at));
      bytes.set(block, at);
      await this.makeIdle();
    }
    return bytes;
  }

  /** Starts the program at this address. The loader may not live to confirm that. */
  async leave(address) {
    await this.command(SET_ADDRESS, address);
    await this.send(DOWNLOAD, FIRST_BLOCK);
    await this.status().catch(() => {});
    await this.close();
  }

  close() {
    return this.device.close().catch(() => {});
  }
}
