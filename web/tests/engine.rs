//! Tests the engine without a browser, in a time of the test's own.

use hivtac_web::engine::Engine;
use serde_json::Value;
use std::cell::Cell;

/// An engine, its time, and the events so far.
struct Page {
    engine: Engine,
    now_us: Cell<u64>,
    events: Vec<(String, Value)>,
}

impl Page {
    fn simulated() -> Page {
        Page::of(Engine::simulated(4, 0, 0).unwrap())
    }

    fn of(engine: Engine) -> Page {
        Page {
            engine,
            now_us: Cell::new(0),
            events: Vec::new(),
        }
    }

    /// Lets time pass until an event is as asked; returns its data.
    fn until(&mut self, name: &str, is_it: impl Fn(&Value) -> bool) -> Value {
        for _ in 0..3_000 {
            let wait_us = self.engine.turn(&|| self.now_us.get());
            self.now_us.set(self.now_us.get() + wait_us.max(1));
            let events: Vec<(String, Value)> = serde_json::from_str(&self.engine.events()).unwrap();
            let found = events.iter().find(|(own, data)| own == name && is_it(data));
            let found = found.map(|(_, data)| data.clone());
            self.events.extend(events);
            if let Some(found) = found {
                return found;
            }
        }
        panic!("no such {name}: {:#?}", self.events.last())
    }

    fn order(&mut self, ticket: u32, body: &str) {
        self.engine
            .order(ticket, body.as_bytes(), self.now_us.get());
    }

    fn answer(&mut self, ticket: u32) -> (bool, String) {
        let answer = self.until("answer", |it| it["ticket"] == ticket);
        let text = answer["text"].as_str().unwrap().to_owned();
        (answer["done"] == true, text)
    }
}

#[test]
fn a_simulated_sensor_obeys_is_pressed_and_is_recorded() {
    let mut page = Page::simulated();
    let hello = page.until("hello", |_| true);
    assert_eq!(hello["presses"], true);
    page.until("state", |it| {
        it["state"]["contact"]
            .as_str()
            .is_some_and(|it| it.contains("needle"))
    });
    page.order(1, r#"{"sensor":0,"order":"record"}"#);
    assert!(page.answer(1).0);
    page.order(
        2,
        r#"{"sensor":0,"order":"press","press":[1.5,-1,0.1,0,0]}"#,
    );
    assert!(page.answer(2).0);
    let pressed = |it: &Value| it["truths"][0][1][3].as_i64().is_some_and(|it| it > 99_000);
    page.until("truths", pressed);
    page.order(3, r#"{"sensor":0,"order":"tare"}"#);
    let (done, why) = page.answer(3);
    assert!(!done && why.contains("refused \"tare\""), "{why}");
    page.engine.picture(4);
    page.until("picture", |it| it["ticket"] == 4);
    let picture = page.engine.blob();
    let line = picture.split(|&byte| byte == b'\n').next().unwrap();
    let reported: Value = serde_json::from_slice(line).unwrap();
    assert_eq!(picture.len(), line.len() + 1 + 4 * 320 * 240);
    assert_eq!(reported["markers"].as_array().unwrap().len(), 4);
    page.order(5, r#"{"sensor":0,"order":"stop_recording"}"#);
    page.until("file", |it| {
        it["name"] == "hivtac-7477696e0000000000000000-1.mcap"
    });
    let file = page.engine.blob();
    assert!(file.starts_with(b"\x89MCAP0\r\n") && file.ends_with(b"\x89MCAP0\r\n"));
    for (ticket, body) in [(6, "{}"), (7, r#"{"sensor":1,"order":"tare"}"#)] {
        page.order(ticket, body);
        assert!(!page.answer(ticket).0, "{body}");
    }
}

#[test]
fn a_silent_port_and_a_lost_one_are_named() {
    let mut page = Page::of(Engine::connected("USB 1209:0001", 0, 0));
    let lost = page.until("lost", |_| true);
    let why = lost["text"].as_str().unwrap();
    assert!(
        why.contains("USB 1209:0001") && why.contains("nothing came"),
        "{why}"
    );
    let mut page = Page::of(Engine::connected("USB 1209:0001", 0, 0));
    page.engine.lost("The device has been lost.", 0);
    let lost = page.until("lost", |_| true);
    assert!(lost["text"].as_str().unwrap().contains("cable pulled"));
}
