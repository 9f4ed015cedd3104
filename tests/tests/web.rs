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
use hivtac_host::recording::Recording;
use hivtac_live::camera::Kind;
use hivtac_tests::artifact;
use hivtac_tests::browser::Browser;
use hivtac_twin::{Load, Preset, Scene};
use hivtac_web::{photograph, same_bits};
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

/// Returns what a promise of the page comes to.
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

/// Chooses a file, as base64, in the page's input.
fn choose(browser: &mut Browser, name: &str, bytes: &[u8]) {
    let text = STANDARD.encode(bytes);
    let script = format!(
        "(() => {{ const bytes = Uint8Array.from(atob('{text}'), (it) => it.charCodeAt(0)); \
         const chosen = new DataTransfer(); chosen.items.add(new File([bytes], '{name}')); \
         const input = document.getElementById('file'); input.files = chosen.files; \
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
    let [sample, told] =
        [(); 2].map(|()| -> Value { serde_json::from_slice(lines.next().unwrap()).unwrap() });
    assert_eq!(shown["markers"], told["markers"]);
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

/// Web Serial with one port. What the page writes waits in `mock.out`; `mock.come` brings bytes.
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
