//! Tests the page that needs no server in a real browser, as a file on disk: the bits of
//! WebAssembly, a press by pointer events, a picture of one's own, and a device by Web Serial. That
//! is mocked, and bridged to `hivtac twin`.

use std::io::{ErrorKind, Read, Write};
use std::net::TcpStream;
use std::process::{Child, Command};
use std::time::{Duration, Instant};

use crate::view::part;
use crate::view_twin::{PAGE, press};
use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use flate2::Compression;
use flate2::write::GzEncoder;
use hivtac_host::live::camera::Kind;
use hivtac_host::recording::Recording;
use hivtac_tests::artifact;
use hivtac_tests::browser::Browser;
use hivtac_twin::{Load, Preset, Scene};
use hivtac_web::{photograph, same_bits};
use hivtac_wire::image::{Image, examples};
use hivtac_wire::message::DeviceMessage;
use serde_json::Value;

/// Frames whose bits are compared.
const FRAMES: u32 = 312;
const PATIENCE: Duration = Duration::from_secs(60);

/// Opens the page, after a script of the test.
fn open(script: &str) -> Browser {
    let folder = artifact::named_by("HIVTAC_WEB");
    let address = format!("file://{}/index.html", folder.display());
    Browser::open_after(script, &address, PAGE).unwrap()
}

/// Returns the result of a promise of the page.
fn awaited(browser: &mut Browser, promise: &str) -> Value {
    let kept = format!("globalThis.awaited = null; {promise}.then((it) => {{ awaited = it; }}); 0");
    browser.value(&kept).unwrap();
    browser.until("awaited").unwrap()
}

#[test]
#[ignore = "slow, and needs Chromium: run by cargo xtask test --all"]
fn web_assembly_gives_the_bits_of_native_code() {
    let mut browser = open("");
    browser.until("globalThis.HIVTAC?.sum").unwrap();
    for (camera, kind) in [Kind::Ov7725, Kind::Mt9v034].into_iter().enumerate() {
        let native = same_bits::sum(kind, FRAMES).unwrap();
        assert!(native.forces > FRAMES / 2, "{native:?}");
        let sum = awaited(&mut browser, &format!("HIVTAC.sum({camera}, {FRAMES})"));
        assert_eq!(sum["crc"], native.crc, "{kind:?}: {sum}");
        assert_eq!(sum["forces"], native.forces, "{kind:?}: {sum}");
        println!(
            "{kind:?}: {} frames a second rendered and sensed in the browser",
            sum["perSecond"]
        );
    }
}

#[test]
#[ignore = "slow, and needs Chromium: run by cargo xtask test --all"]
fn a_press_on_the_page_is_read_within_three_sigma() {
    press(&mut open(""), "web.png");
}

#[test]
#[ignore = "slow, and needs Chromium: run by cargo xtask test --all"]
fn a_press_on_eight_dots_is_read_within_three_sigma() {
    let mut browser = open("");
    browser.until("document.getElementById('dots')").unwrap();
    let chosen = "(() => { const dots = document.getElementById('dots'); dots.value = '8'; \
                  dots.dispatchEvent(new Event('change')); return 1; })()";
    browser.value(chosen).unwrap();
    press(&mut browser, "web-eight.png");
}

/// Chooses a file, as base64, in the page's input for pictures.
fn choose(browser: &mut Browser, name: &str, bytes: &[u8]) {
    choose_in(browser, "file", name, bytes);
}

/// As [`choose`], in the input with this id.
fn choose_in(browser: &mut Browser, input: &str, name: &str, bytes: &[u8]) {
    let text = STANDARD.encode(bytes);
    let script = format!(
        "(() => {{ const bytes = Uint8Array.from(atob('{text}'), (it) => it.charCodeAt(0)); \
         const chosen = new DataTransfer(); chosen.items.add(new File([bytes], '{name}')); \
         const input = document.getElementById('{input}'); input.files = chosen.files; \
         input.dispatchEvent(new Event('change')); return 0; }})()"
    );
    browser.value(&script).unwrap();
}

#[test]
#[ignore = "slow, and needs Chromium: run by cargo xtask test --all"]
fn a_picture_of_ones_own_is_sensed_as_by_native_code() {
    let scene = Scene::preset("rest", Preset::Ov7725, 320, 240, 1).unwrap();
    let load = Load::from_angles(0.1, 4.0, -3.0).unwrap();
    let pixels = scene.render_load(&load, 3).unwrap().pixels;
    let levels: Vec<[u8; 3]> = pixels.into_iter().map(hivtac_terms::hsv::rgb888).collect();
    let colour = hivtac_host::picture::Channels::Colour;
    let file = hivtac_host::picture::encode("a.png", colour, 320, 240, levels.as_flattened());
    let mut browser = open("");
    browser.until("document.getElementById('file')").unwrap();
    choose(&mut browser, "a.png", &file.unwrap());
    let shown = browser
        .until("document.querySelector('.own').dataset.shown")
        .unwrap();
    let shown: Value = serde_json::from_str(shown.as_str().unwrap()).unwrap();
    let with_opacity: Vec<u8> = levels
        .iter()
        .flat_map(|[r, g, b]| [*r, *g, *b, 255])
        .collect();
    let native = photograph::sense(&with_opacity, 320, 240);
    let mut lines = native.split(|&byte| byte == b'\n');
    let [sample, reported] =
        [(); 2].map(|()| -> Value { serde_json::from_slice(lines.next().unwrap()).unwrap() });
    assert_eq!(shown["markers"], reported["markers"]);
    assert_eq!(shown["markers"].as_array().unwrap().len(), 4);
    let size = sample["sample"][4][3].as_f64().unwrap() / 1e3;
    assert!((shown["force"]["magnitude"].as_f64().unwrap() - size).abs() < 1e-9);
    assert!((size - 100.0).abs() < 10.0, "{size}");
    choose(&mut browser, "b.txt", b"no picture");
    let said = browser.until("document.getElementById('said').textContent");
    assert!(
        said.unwrap()
            .as_str()
            .unwrap()
            .contains("b.txt: this is no picture")
    );
}

/// Web Serial with one port. The page's output waits in `mock.out`; `mock.come` brings bytes.
/// `mock.held` says that another program has the port. Files that are offered are kept.
const MOCK: &str = r#"
const mock = globalThis.mock = { out: [], held: false, chosen: true, incoming: null, saved: null };
const base64 = (bytes) => btoa(String.fromCharCode(...bytes));
const bytesOf = (text) => Uint8Array.from(atob(text), (it) => it.charCodeAt(0));
mock.take = () => mock.out.splice(0);
mock.come = (text) => mock.incoming.enqueue(bytesOf(text));
mock.pull = () => mock.incoming.error(new DOMException("The device has been lost.", "NetworkError"));
const port = {
  getInfo: () => ({ usbVendorId: 0x1209, usbProductId: 1 }),
  async open({ baudRate }) {
    if (!(baudRate > 0)) throw new TypeError("a rate is needed");
    if (mock.held) throw new DOMException("Failed to open serial port.", "NetworkError");
    port.readable = new ReadableStream({ start: (it) => { mock.incoming = it; } });
    port.writable = new WritableStream({ write: (it) => { mock.out.push(base64(it)); } });
  },
  async close() {},
};
const requestPort = async () => {
  if (!mock.chosen) throw new DOMException("No port selected by the user.", "NotFoundError");
  return port;
};
Object.defineProperty(navigator, "serial", { value: { requestPort } });
const make = URL.createObjectURL;
URL.createObjectURL = (blob) => {
  if (blob.type === "application/octet-stream") {
    blob.arrayBuffer().then((it) => {
      const bytes = new Uint8Array(it);
      const parts = [];
      for (let at = 0; at < bytes.length; at += 3000) parts.push(base64(bytes.subarray(at, at + 3000)));
      mock.saved = parts.join("");
    });
  }
  return make(blob);
};
"#;

/// `hivtac twin` at rest; killed when it is dropped.
struct Twin {
    process: Child,
    line: TcpStream,
}

impl Twin {
    fn start() -> Twin {
        let mut tool = Command::new(artifact::named_by("HIVTAC_TOOL"));
        tool.args(["twin", "--scene", "static", "--listen", "0"]);
        let (process, address) = artifact::ready(&mut tool);
        let line = TcpStream::connect(address.strip_prefix("tcp=").unwrap()).unwrap();
        line.set_read_timeout(Some(Duration::from_millis(10)))
            .unwrap();
        Twin { process, line }
    }

    /// Passes bytes between page and twin until an expression in the page is true; returns it.
    fn until(&mut self, browser: &mut Browser, condition: &str) -> Value {
        let end = Instant::now() + PATIENCE;
        let mut buffer = vec![0; 1 << 16];
        while Instant::now() < end {
            let written = browser.value("mock.take()").unwrap();
            for part in written.as_array().unwrap() {
                let bytes = STANDARD.decode(part.as_str().unwrap()).unwrap();
                self.line.write_all(&bytes).unwrap();
            }
            match self.line.read(&mut buffer) {
                Ok(0) => panic!("the twin hung up"),
                Ok(length) => {
                    let text = STANDARD.encode(&buffer[..length]);
                    browser.value(&format!("mock.come('{text}'); 0")).unwrap();
                }
                Err(error) => assert_eq!(error.kind(), ErrorKind::WouldBlock, "{error}"),
            }
            let value = browser.value(condition).unwrap();
            if ![Value::Null, false.into(), "".into()].contains(&value) {
                return value;
            }
        }
        let page = browser.value("document.body.innerText").unwrap();
        panic!("{condition}: not within {PATIENCE:?}; the page: {page}")
    }
}

impl Drop for Twin {
    fn drop(&mut self) {
        // Fails only if it has ended.
        let _ = self.process.kill();
        let _ = self.process.wait();
    }
}

const CONNECT: &str = "document.getElementById('connect').click(); 0";
const SAID: &str = "document.getElementById('said').textContent";

#[test]
#[ignore = "slow, and needs Chromium: run by cargo xtask test --all"]
fn a_device_at_a_serial_port_is_shown_set_and_recorded() {
    let mut twin = Twin::start();
    let mut browser = open(MOCK);
    browser.until("document.getElementById('connect')").unwrap();
    browser.value(CONNECT).unwrap();
    let text = |name: &str| format!("{}?.textContent", part(name));
    let has = |name: &str, words: &str| format!("{}?.includes('{words}')", text(name));
    twin.until(&mut browser, &has("facts", "USB 1209:0001"));
    assert_eq!(
        browser.value(&format!("{}.hidden", part("truth"))).unwrap(),
        true
    );
    twin.until(&mut browser, &has("contact-in-use", "unknown"));
    twin.until(&mut browser, &format!("{}?.dataset.frame", part("numbers")));
    let click = |name: &str| format!("document.querySelector('[data-do=\"{name}\"]').click(); 0");
    // The static scene presses: a tare is refused, as the device says.
    browser.value(&click("tare")).unwrap();
    let refused = twin.until(&mut browser, &has("answer", "refused \"tare\""));
    assert_eq!(refused, true);
    let needle = format!(
        "(() => {{ const it = {}; it.value = 'needle'; it.dispatchEvent(new Event('change')); \
         return 0; }})()",
        part("shape")
    );
    browser.value(&needle).unwrap();
    twin.until(&mut browser, &has("contact-in-use", "needle"));
    let slider = "document.querySelector('[data-limit=\"lowest saturation\"]')";
    let slide = format!(
        "(() => {{ const it = {slider}; it.value = 120; it.dispatchEvent(new Event('input')); \
         return 0; }})()"
    );
    browser.value(&slide).unwrap();
    let limits = format!(
        "{}.dataset.limits === '170,10,120,255,45,255'",
        part("picture")
    );
    twin.until(&mut browser, &limits);
    browser.value(&click("record")).unwrap();
    twin.until(
        &mut browser,
        &format!("/, (\\d{{3,}}) received/.exec({})", text("recording")),
    );
    browser.value(&click("stop_recording")).unwrap();
    let saved = twin.until(&mut browser, "mock.saved");
    check_recording(&STANDARD.decode(saved.as_str().unwrap()).unwrap());
    // The cable is pulled.
    browser.value("mock.pull(); 0").unwrap();
    let lost = browser.until(&has("lights", "connection to USB 1209:0001 lost"));
    lost.unwrap();
    browser
        .value("document.getElementById('simulate').click(); 0")
        .unwrap();
    browser
        .until(&has("facts", "simulated in this page"))
        .unwrap();
}

/// A recording of the page is read by the tool's reader, without a gap.
fn check_recording(bytes: &[u8]) {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("page.mcap");
    std::fs::write(&file, bytes).unwrap();
    let (mut recording, hello) = Recording::open(&file, None).unwrap();
    assert!(hello.board.starts_with("twin"), "{}", hello.board);
    let mut sequences = Vec::new();
    while let Some((_, message)) = recording.next_message().unwrap() {
        if let DeviceMessage::Sample(sample) = message {
            sequences.push(sample.sequence);
        }
    }
    assert!(sequences.len() >= 100, "{}", sequences.len());
    let is_next = |pair: &[u32]| pair[1] == pair[0] + 1;
    assert!(sequences.windows(2).all(is_next), "{sequences:?}");
}

#[test]
#[ignore = "slow, and needs Chromium: run by cargo xtask test --all"]
fn what_hinders_a_connection_is_said() {
    let mut browser = open(MOCK);
    browser.until("document.getElementById('connect')").unwrap();
    for (state, words) in [
        ("mock.held = true", "another program"),
        (
            "mock.held = false; mock.chosen = false",
            "no port was chosen",
        ),
        ("mock.chosen = true", "is it a HiVTac sensor"),
    ] {
        browser.value(&format!("{state}; {CONNECT}")).unwrap();
        let said = format!("{SAID}.includes('{words}')");
        browser.until(&said).unwrap();
    }
    let without = "delete Navigator.prototype.serial;";
    let mut browser = open(without);
    browser.until("document.getElementById('connect')").unwrap();
    browser.value(CONNECT).unwrap();
    browser
        .until(&format!("{SAID}.includes('no Web Serial')"))
        .unwrap();
}

/// WebUSB with the loader of an STM32H743, of 16 sectors. It answers as AN3156 says, and records
/// forbidden requests. `loader.wrong` flips a bit of the flash; `loader.end` pulls the cable after
/// that many blocks.
const LOADER: &str = r#"
const loader = globalThis.loader = { wrong: false, end: Infinity, misuse: [] };
const FLASH = 0x08000000, SECTOR = 128 << 10;
const flash = loader.flash = new Uint8Array(16 * SECTOR).fill(0xff);
let state = 2, address = 0, begun = null, left = false;
const reply = (bytes) => ({ status: "ok", data: new DataView(new Uint8Array(bytes).buffer) });
const misuse = (what) => { loader.misuse.push(what); state = 10; };
function carryOut({ value, bytes }) {
  if (value === 0) {
    const at = new DataView(bytes.buffer, bytes.byteOffset).getUint32(1, true) - FLASH;
    if (at < 0 || at >= flash.length) return misuse(`address ${at}`);
    if (bytes[0] === 0x41) {
      if (at % SECTOR !== 0) return misuse(`erase at ${at}`);
      flash.fill(0xff, at, at + SECTOR);
    } else if (bytes[0] === 0x21) address = at;
    else return misuse(`command ${bytes[0]}`);
  } else {
    const at = address + (value - 2) * 1024;
    if (flash.subarray(at, at + bytes.length).some((it) => it !== 0xff)) return misuse(`not blank ${at}`);
    flash.set(bytes, at);
    if (loader.wrong) flash[at] ^= 1;
    loader.end -= 1;
  }
  state = 5;
}
const lost = () => {
  if (loader.end <= 0 || left) throw new DOMException("A transfer error has occurred.", "NetworkError");
};
const alternates = [{
  alternateSetting: 0, interfaceClass: 0xfe, interfaceSubclass: 1, interfaceProtocol: 2,
  interfaceName: "@Internal Flash  /0x08000000/16*128Kg",
}];
const device = {
  configuration: { interfaces: [{ interfaceNumber: 0, alternates }] },
  async open() { left = false; state = 2; },
  async close() {},
  async claimInterface() {},
  async selectAlternateInterface() {},
  async controlTransferIn({ requestType, request, value }, length) {
    if (requestType === "standard") return reply([9, 2, 27, 0, 1, 1, 0, 0xc0, 50, 9, 0x21, 11, 255, 0, 0, 4, 0x1a, 1]);
    lost();
    if (request === 3) {
      const was = state;
      if (state === 3 && begun.bytes.length === 0) { left = true; return reply([0, 1, 0, 0, 7, 0]); }
      if (state === 3) { state = 4; return reply([0, 1, 0, 0, 4, 0]); }
      if (state === 4) carryOut(begun);
      return reply([state === 10 ? 3 : 0, 0, 0, 0, was === 4 ? state : was, 0]);
    }
    if (request === 2) {
      if (state !== 2 && state !== 9) { misuse(`upload in ${state}`); return { status: "stall" }; }
      state = 9;
      const at = address + (value - 2) * 1024;
      return reply(flash.slice(at, at + length));
    }
    misuse(`request ${request}`);
    return { status: "stall" };
  },
  async controlTransferOut({ request, value }, bytes) {
    lost();
    if (request === 1) {
      if (state !== 2 && state !== 5) { misuse(`download in ${state}`); return { status: "stall" }; }
      begun = { value, bytes: bytes.slice() };
      state = 3;
    } else if (request === 4 || request === 6) state = 2;
    return { status: "ok" };
  },
};
const requestDevice = async ({ filters }) => {
  if (filters[0].vendorId !== 0x483 || filters[0].productId !== 0xdf11) throw new TypeError("another device");
  return device;
};
Object.defineProperty(navigator, "usb", { value: { requestDevice }, configurable: true });
loader.has = (text) => {
  const image = Uint8Array.from(atob(text), (it) => it.charCodeAt(0));
  return flash.every((it, at) => it === (image[at] ?? 0xff));
};
"#;

/// Presses the button that writes, and waits until the page says these words.
fn write(browser: &mut Browser, words: &str) {
    let said = "document.getElementById('flashed').textContent";
    browser
        .value("document.getElementById('flash').click(); 0")
        .unwrap();
    let done = format!(
        "!document.getElementById('flash').disabled && {said} !== '' && {said}.includes('{words}')"
    );
    browser.until(&done).unwrap();
}

#[test]
#[ignore = "slow, and needs Chromium: run by cargo xtask test --all"]
fn firmware_is_checked_written_and_read_back() {
    let image = examples::image("weact-h743", "1.2.3", 200_000, 7);
    let mut packed = GzEncoder::new(Vec::new(), Compression::fast());
    packed.write_all(image.bytes()).unwrap();
    let packed = packed.finish().unwrap();
    let bits = packed
        .iter()
        .flat_map(|byte| (0..8).rev().map(move |k| byte >> k & 1));
    let bits: Vec<u8> = bits.collect();
    // Seven bits a number, as those of the page's text.
    let sevens = bits
        .chunks(7)
        .map(|bits| (0..7).fold(0, |all, k| all << 1 | bits.get(k).unwrap_or(&0)));
    let sevens: Vec<u8> = sevens.collect();
    let carried =
        format!("globalThis.FIRMWARE = {{ 'weact-h743': String.fromCharCode(...{sevens:?}) }};");
    let mut browser = open(&(LOADER.to_owned() + &carried));
    browser.until("document.getElementById('image')").unwrap();
    let said =
        |words: &str| format!("document.getElementById('flashed').textContent.includes('{words}')");
    let mut damaged = image.bytes().to_vec();
    damaged[140_000] ^= 1;
    choose_in(&mut browser, "image", "damaged.bin", &damaged);
    browser.until(&said("damaged.bin: damaged")).unwrap();
    let is_off = "document.getElementById('flash').disabled";
    assert_eq!(browser.value(is_off).unwrap(), true);
    // The page carries firmware, too.
    let own = "[...document.querySelectorAll('#firmware button')].find((it) => \
               it.textContent.includes('weact-h743'))";
    browser.value(&format!("{own}.click(); 0")).unwrap();
    browser
        .until(&said("page\\'s: firmware 1.2.3 for weact-h743"))
        .unwrap();
    choose_in(&mut browser, "image", "good.bin", image.bytes());
    browser
        .until(&said("good.bin: firmware 1.2.3 for weact-h743"))
        .unwrap();
    // A blank device gets the first stage, too.
    write(&mut browser, "every byte read back");
    assert_same(&mut browser, &image);
    // Cut, it is written again; the first stage stays.
    browser.value("loader.end = 20; 0").unwrap();
    write(&mut browser, "choose the loader and write again");
    browser.value("loader.end = Infinity; 0").unwrap();
    write(&mut browser, "every byte read back");
    assert_same(&mut browser, &image);
    browser.value("loader.wrong = true; 0").unwrap();
    write(&mut browser, "kept other bytes");
    browser.value("loader.wrong = false; 0").unwrap();
    let other = examples::image("openmv-h7", "1.2.3", 200_000, 7);
    choose_in(&mut browser, "image", "other.bin", other.bytes());
    browser.until(&said("other.bin: firmware")).unwrap();
    write(&mut browser, "is another one: for the board openmv-h7");
    assert_eq!(browser.value("loader.misuse.join()").unwrap(), "");
    // The simulated sensor has no loader.
    browser
        .value("document.getElementById('restart').click(); 0")
        .unwrap();
    browser.until(&said("no device is connected")).unwrap();
    browser
        .value("delete Object.getPrototypeOf(navigator).usb; delete navigator.usb; 0")
        .unwrap();
    write(&mut browser, "no WebUSB");
}

/// The loader's flash has the image, and is blank behind it.
fn assert_same(browser: &mut Browser, image: &Image) {
    let has = format!("loader.has('{}')", STANDARD.encode(image.bytes()));
    assert_eq!(browser.value(&has).unwrap(), true);
}
