// A device at a serial port of this computer, by Web Serial.

/** The device's identity on USB, as in wire/src/usb.rs. */
const USB = { usbVendorId: 0x1209, usbProductId: 0x0001 };
/** Web Serial needs a rate; on USB it has no meaning. */
const BAUD = 115200;
/** Room for bytes that come while the page is busy. */
const BUFFER = 1 << 16;

/** Why this page cannot open a port; null if it can. */
export function whyNot() {
  if ("serial" in navigator) return null;
  if (!window.isSecureContext) {
    return "a page from another computer may open ports only over https: open this page by " +
      "https, from localhost, or as a file on this computer";
  }
  return "this browser has no Web Serial: use a current Chrome, Edge or Firefox on a computer, " +
    "or `hivtac view`; the simulated sensor and pictures work here, too";
}

/** Cause and remedy when a port cannot be opened. */
function refused(error) {
  const advice = {
    NotFoundError: "no port was chosen; if yours is not listed: connect the sensor, and try " +
      "another USB cable, as some only charge",
    SecurityError: "the browser does not let this page use ports: allow it in the page's settings",
    InvalidStateError: "this page has the port open already: load the page again",
    NetworkError: "the port cannot be opened: another program or another page may hold it, such " +
      "as hivtac or a serial monitor, so end that and connect again; on Linux your user must be " +
      "in the group dialout",
  };
  return new Error(advice[error.name] ?? `the port cannot be opened: ${error.message}`);
}

const hex = (number) => number.toString(16).padStart(4, "0");

function nameOf(port) {
  const { usbVendorId, usbProductId } = port.getInfo();
  return usbVendorId === undefined
    ? "serial port" : `USB ${hex(usbVendorId)}:${hex(usbProductId)}`;
}

/** Opens the port that the user chooses, and connects it; returns a function that closes it. */
export async function open(connect, say) {
  let port;
  try {
    port = await navigator.serial.requestPort({ filters: [USB] });
    await port.open({ baudRate: BAUD, bufferSize: BUFFER });
  } catch (error) {
    throw refused(error);
  }
  const reader = port.readable.getReader();
  const writer = port.writable.getWriter();
  let closing = null;
  const close = () => {
    closing ??= (async () => {
      await reader.cancel().catch(() => {});
      await writer.close().catch(() => {});
      reader.releaseLock();
      writer.releaseLock();
      await port.close().catch(() => {});
    })();
    return closing;
  };
  const device = connect({
    name: nameOf(port),
    send: (bytes) => writer.write(bytes).catch((error) => device.lost(error.message)),
    close: (why) => {
      say(why);
      return close();
    },
  });
  read(reader, device, () => closing !== null);
  return { close };
}

async function read(reader, device, isClosing) {
  try {
    for (;;) {
      const { value, done } = await reader.read();
      if (done) break;
      device.receive(value);
    }
    if (!isClosing()) device.lost("the port was closed");
  } catch (error) {
    device.lost(error.message);
  }
}
