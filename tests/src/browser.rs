//! A headless Chromium in the place of a user's browser. Tests open a page, read it and press keys
//! through its DevTools protocol, over two pipes.

use std::fs::{self, File, OpenOptions};
use std::io::{BufRead, BufReader, Write};
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::string::String;
use std::sync::mpsc::{Receiver, channel};
use std::time::{Duration, Instant};
use std::{thread, vec::Vec};

use anyhow::{Context, Result, bail, ensure};
use base64::Engine;
use serde_json::{Value, json};
use tempfile::TempDir;

use crate::artifact;

/// The longest wait for an answer or for a page's state: the emulator behind the page runs at about
/// a tenth of real time.
const PATIENCE: Duration = Duration::from_secs(120);

/// A browser with one page; killed when it is dropped.
pub struct Browser {
    process: Child,
    commands: File,
    answers: Receiver<Value>,
    session: String,
    last_id: u64,
    _folder: TempDir,
}

impl Browser {
    /// Starts the browser (`HIVTAC_CHROMIUM`) with a page of this size in pixels.
    ///
    /// # Errors
    /// If it does not start.
    pub fn open(address: &str, size: [u32; 2]) -> Result<Browser> {
        Browser::open_after("", address, size)
    }

    /// The same, with a script that runs before the page's own.
    ///
    /// # Errors
    /// If it does not start.
    pub fn open_after(script: &str, address: &str, [width, height]: [u32; 2]) -> Result<Browser> {
        let folder = tempfile::tempdir().context("creating a temporary folder")?;
        let pipes = ["commands", "answers"].map(|name| folder.path().join(name));
        let made = Command::new("mkfifo").args(&pipes).status()?;
        ensure!(made.success(), "mkfifo failed");
        // The browser reads its file descriptor 3 and writes its file descriptor 4.
        let process = Command::new("sh")
            .args(["-c", "exec \"$@\" 3<\"$COMMANDS\" 4>\"$ANSWERS\"", "sh"])
            .arg(artifact::named_by("HIVTAC_CHROMIUM"))
            .args(["--headless=new", "--remote-debugging-pipe"])
            // The only page is our own, and root cannot use the sandbox.
            .args(["--no-sandbox", "--disable-gpu", "--hide-scrollbars"])
            .args(["--no-first-run", "--disable-background-networking"])
            .arg(std::format!("--window-size={width},{height}"))
            .arg(std::format!("--user-data-dir={}", folder.path().display()))
            .env("COMMANDS", &pipes[0])
            .env("ANSWERS", &pipes[1])
            .stdin(Stdio::null())
            .stdout(Stdio::null())
            .stderr(File::create(folder.path().join("log"))?)
            .spawn()
            .context("starting Chromium")?;
        let commands = OpenOptions::new().write(true).open(&pipes[0])?;
        let mut browser = Browser {
            process,
            commands,
            answers: messages(File::open(&pipes[1])?),
            session: String::new(),
            last_id: 0,
            _folder: folder,
        };
        browser.attach("about:blank")?;
        browser.call("Page.enable", json!({}))?;
        let first = json!({ "source": script });
        browser.call("Page.addScriptToEvaluateOnNewDocument", first)?;
        let opened = browser.call("Page.navigate", json!({ "url": address }))?;
        ensure!(opened["errorText"].is_null(), "{address}: {opened}");
        Ok(browser)
    }

    fn attach(&mut self, address: &str) -> Result<()> {
        let target = self.call("Target.createTarget", json!({ "url": address }))?;
        let target = json!({ "targetId": target["targetId"], "flatten": true });
        let session = self.call("Target.attachToTarget", target)?;
        self.session = String::from(session["sessionId"].as_str().context("no session")?);
        Ok(())
    }

    /// Calls a method of the browser, and returns its answer.
    fn call(&mut self, method: &str, parameters: Value) -> Result<Value> {
        self.last_id += 1;
        let id = self.last_id;
        let mut message = json!({ "id": id, "method": method, "params": parameters });
        if !self.session.is_empty() {
            message["sessionId"] = json!(self.session);
        }
        self.commands
            .write_all(std::format!("{message}\0").as_bytes())?;
        loop {
            let answer = self.answers.recv_timeout(PATIENCE);
            let answer = answer.with_context(|| std::format!("{method}: no answer"))?;
            if answer["id"] == id {
                ensure!(answer["error"].is_null(), "{method}: {answer}");
                return Ok(answer["result"].clone());
            }
        }
    }

    /// Returns the value of an expression in the page.
    ///
    /// # Errors
    /// If the expression throws.
    pub fn value(&mut self, expression: &str) -> Result<Value> {
        let parameters = json!({ "expression": expression, "returnByValue": true });
        let answer = self.call("Runtime.evaluate", parameters)?;
        ensure!(
            answer["exceptionDetails"].is_null(),
            "{expression}: {answer}"
        );
        Ok(answer["result"]["value"].clone())
    }

    /// Waits until an expression in the page is neither null, 0 nor an empty text, and returns its
    /// value.
    ///
    /// # Errors
    /// If the expression throws, or keeps such a value for too long.
    pub fn until(&mut self, expression: &str) -> Result<Value> {
        let end = Instant::now() + PATIENCE;
        while Instant::now() < end {
            let value = self.value(expression)?;
            let nothing = [Value::Null, json!(false), json!(0), json!("")];
            if !nothing.contains(&value) {
                return Ok(value);
            }
            thread::sleep(Duration::from_millis(50));
        }
        let page = self.value("document.body.innerText")?;
        bail!("{expression}: nothing within {PATIENCE:?}; the page: {page}")
    }

    /// Presses a key and releases it. The key is given by its name, and by the Windows key code
    /// that browsers use.
    ///
    /// # Errors
    /// If the browser is gone.
    pub fn key(&mut self, name: &str, code: u32) -> Result<()> {
        for kind in ["rawKeyDown", "keyUp"] {
            let key = json!({ "type": kind, "key": name, "windowsVirtualKeyCode": code });
            self.call("Input.dispatchKeyEvent", key)?;
        }
        Ok(())
    }

    /// Moves the pointer to a place in the page, px, and there presses or releases its first
    /// button: `mousePressed`, `mouseMoved` or `mouseReleased`. `shift` says whether that key is
    /// held.
    ///
    /// # Errors
    /// If the browser is gone.
    pub fn pointer(&mut self, kind: &str, [x, y]: [f64; 2], shift: bool) -> Result<()> {
        let is_held = kind != "mouseReleased";
        let event = json!({
            "type": kind, "x": x, "y": y, "button": "left", "clickCount": 1,
            "buttons": u8::from(is_held), "modifiers": if shift { 8 } else { 0 },
        });
        self.call("Input.dispatchMouseEvent", event)?;
        Ok(())
    }

    /// Turns the wheel over a place in the page, px; negative is away from the user.
    ///
    /// # Errors
    /// If the browser is gone.
    pub fn wheel(&mut self, [x, y]: [f64; 2], turn: f64) -> Result<()> {
        let event = json!({ "type": "mouseWheel", "x": x, "y": y, "deltaX": 0, "deltaY": turn });
        self.call("Input.dispatchMouseEvent", event)?;
        Ok(())
    }

    /// Sets the colour scheme that the user prefers, `light` or `dark`.
    ///
    /// # Errors
    /// If the browser is gone.
    pub fn colours(&mut self, scheme: &str) -> Result<()> {
        let feature = json!({ "name": "prefers-color-scheme", "value": scheme });
        self.call(
            "Emulation.setEmulatedMedia",
            json!({ "features": [feature] }),
        )?;
        Ok(())
    }

    /// Saves a screenshot as PNG.
    ///
    /// # Errors
    /// If the file cannot be written.
    pub fn keep(&mut self, file: &Path) -> Result<()> {
        let answer = self.call("Page.captureScreenshot", json!({ "format": "png" }))?;
        let data = answer["data"].as_str().context("no screenshot")?;
        let bytes = base64::engine::general_purpose::STANDARD.decode(data)?;
        fs::write(file, bytes).with_context(|| std::format!("writing {}", file.display()))
    }
}

impl Drop for Browser {
    fn drop(&mut self) {
        // Fails only if the browser has already ended.
        let _ = self.process.kill();
        let _ = self.process.wait();
    }
}

/// Receives the browser's messages: JSON texts, each followed by a zero byte.
fn messages(pipe: File) -> Receiver<Value> {
    let (sender, receiver) = channel();
    thread::spawn(move || {
        for text in BufReader::new(pipe).split(0) {
            let text: Vec<u8> = text.unwrap_or_default();
            let Ok(message) = serde_json::from_slice(&text) else {
                return;
            };
            if sender.send(message).is_err() {
                return;
            }
        }
    });
    receiver
}
