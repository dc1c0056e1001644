//! A headless Chromium of our own, driven over its DevTools protocol through two pipes.

use serde_json::{Value, json};
use slipwatch::runtime::clock::Stopwatch;
use std::fs::File;
use std::io::{BufRead, BufReader, Write};
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::Duration;
use tempfile::TempDir;

/// A page that does not come to show what is waited for in this time is broken.
const LIMIT: Duration = Duration::from_secs(20);

pub(crate) struct Chromium {
    process: Child,
    commands: File,
    answers: BufReader<File>,
    number: u64,
    session: Option<String>,
    /// What the page complained of: errors, refused scripts.
    pub(crate) complaints: Vec<String>,
    _folder: TempDir,
}

impl Chromium {
    pub(crate) fn start() -> Self {
        let programs = ["/usr/bin/chromium", "/usr/bin/chromium-browser"];
        let program = programs.into_iter().find(|one| Path::new(one).exists());
        let program = program.expect("Chromium (apt-get install chromium; touch build.rs)");
        let folder = tempfile::tempdir().unwrap();
        let pipe = |name: &str| {
            let path = folder.path().join(name);
            nix::unistd::mkfifo(&path, nix::sys::stat::Mode::S_IRWXU).unwrap();
            path
        };
        let (commands, answers) = (pipe("commands"), pipe("answers"));
        // The shell opens the pipes under the numbers that Chromium wants.
        let script = "exec \"$0\" \"$@\" 3<commands 4>answers";
        let process = Command::new("sh")
            .args(["-c", script, program])
            .args(["--headless=new", "--remote-debugging-pipe", "--no-sandbox"])
            .args(["--disable-gpu", "--hide-scrollbars", "--no-first-run"])
            .args(["--disable-dev-shm-usage", "--disable-background-networking"])
            .args(["--force-device-scale-factor=1", "--lang=en"])
            .arg(format!("--user-data-dir={}", folder.path().display()))
            .current_dir(folder.path())
            .stdin(Stdio::null())
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .spawn()
            .unwrap();
        let mut browser = Self {
            process,
            commands: File::options().write(true).open(commands).unwrap(),
            answers: BufReader::new(File::open(answers).unwrap()),
            number: 0,
            session: None,
            complaints: Vec::new(),
            _folder: folder,
        };
        browser.open();
        browser
    }

    fn open(&mut self) {
        let target = self.call("Target.createTarget", &json!({ "url": "about:blank" }));
        let asked = json!({ "targetId": target["targetId"], "flatten": true });
        let attached = self.call("Target.attachToTarget", &asked);
        self.session = attached["sessionId"].as_str().map(str::to_owned);
        for domain in ["Page", "Runtime", "Log"] {
            self.call(&format!("{domain}.enable"), &json!({}));
        }
    }

    /// Calls a method and waits for its answer; complaints that come meanwhile are kept.
    pub(crate) fn call(&mut self, method: &str, parameters: &Value) -> Value {
        self.number += 1;
        let mut message = json!({ "id": self.number, "method": method, "params": parameters });
        if let Some(session) = &self.session {
            message["sessionId"] = json!(session);
        }
        let mut bytes = serde_json::to_vec(&message).unwrap();
        bytes.push(0);
        self.commands.write_all(&bytes).unwrap();
        loop {
            let answer = self.read();
            if answer["id"] == self.number {
                // While another page is being loaded there is nothing to ask.
                let said = answer["error"]["message"].as_str().unwrap_or_default();
                if said.contains("navigated") || said.contains("context") {
                    return Value::Null;
                }
                assert!(answer["error"].is_null(), "{method}: {answer}");
                return answer["result"].clone();
            }
            self.note(&answer);
        }
    }

    fn read(&mut self) -> Value {
        let mut bytes = Vec::new();
        self.answers.read_until(0, &mut bytes).unwrap();
        assert_eq!(bytes.pop(), Some(0), "Chromium has ended");
        serde_json::from_slice(&bytes).unwrap()
    }

    fn note(&mut self, event: &Value) {
        let what = &event["params"];
        let complaint = match event["method"].as_str() {
            Some("Runtime.exceptionThrown") => what["exceptionDetails"].to_string(),
            Some("Log.entryAdded") if what["entry"]["level"] == "error" => {
                what["entry"].to_string()
            }
            Some("Runtime.consoleAPICalled") if what["type"] == "error" => what["args"].to_string(),
            _ => return,
        };
        self.complaints.push(complaint);
    }

    /// The size of the window, and whether its person likes it dark.
    pub(crate) fn look(&mut self, (width, height): (u32, u32), is_dark: bool) {
        let size = json!({ "width": width, "height": height, "deviceScaleFactor": 1, "mobile": width < 600 });
        self.call("Emulation.setDeviceMetricsOverride", &size);
        let scheme = if is_dark { "dark" } else { "light" };
        let media = json!({ "features": [{ "name": "prefers-color-scheme", "value": scheme }] });
        self.call("Emulation.setEmulatedMedia", &media);
        // A phone is touched.
        let touch = json!({ "enabled": width < 600 });
        self.call("Emulation.setTouchEmulationEnabled", &touch);
    }

    pub(crate) fn visit(&mut self, address: &str) {
        self.call("Page.navigate", &json!({ "url": address }));
    }

    /// The value of an expression on the page.
    pub(crate) fn value(&mut self, expression: &str) -> Value {
        let asked =
            json!({ "expression": expression, "returnByValue": true, "awaitPromise": true });
        let answer = self.call("Runtime.evaluate", &asked);
        let failure = &answer["exceptionDetails"];
        assert!(failure.is_null(), "{expression}: {failure}");
        answer["result"]["value"].clone()
    }

    /// The text of the page, as a person reads it.
    pub(crate) fn text(&mut self, selector: &str) -> String {
        let selector = json!(selector);
        let text = self.value(&format!(
            "document.querySelector({selector})?.innerText ?? ''"
        ));
        text.as_str().unwrap().to_owned()
    }

    /// Waits until an expression is true; one that cannot be asked yet, because the page is being loaded, is not.
    pub(crate) fn until(&mut self, expression: &str) {
        let asked = format!(
            "(() => {{ try {{ return Boolean({expression}); }} catch {{ return false; }} }})()"
        );
        let start = Stopwatch::start();
        while self.value(&asked) != true {
            if start.elapsed() > LIMIT {
                let shown = self.value("document.body.innerText");
                panic!("never: {expression}; {:?}; {shown}", self.complaints);
            }
            std::thread::sleep(Duration::from_millis(50));
        }
    }

    /// Clicks on the middle of an element, with the mouse.
    pub(crate) fn click(&mut self, selector: &str) {
        let selector = json!(selector);
        self.until(&format!("document.querySelector({selector})"));
        let place = self.value(&format!(
            "(() => {{ const node = document.querySelector({selector}); node.scrollIntoView({{ block: 'center' }});
               const box = node.getBoundingClientRect(); return [box.x + box.width / 2, box.y + box.height / 2]; }})()"
        ));
        for kind in ["mousePressed", "mouseReleased"] {
            let event = json!({ "type": kind, "x": place[0], "y": place[1], "button": "left", "clickCount": 1 });
            self.call("Input.dispatchMouseEvent", &event);
        }
    }

    /// Drags the mouse across an element, from one share of its width to another.
    pub(crate) fn drag(&mut self, selector: &str, from: f64, to: f64) {
        let selector = json!(selector);
        let place = self.value(&format!(
            "(() => {{ const node = document.querySelector({selector}); node.scrollIntoView({{ block: 'center' }});
               const box = node.getBoundingClientRect(); return [box.x, box.y + box.height / 2, box.width]; }})()"
        ));
        let [x, y, width] = [0, 1, 2].map(|index| place[index].as_f64().unwrap());
        let at = |share: f64| x + share * width;
        let steps = [
            ("mouseMoved", from, 0),
            ("mousePressed", from, 1),
            ("mouseMoved", f64::midpoint(from, to), 1),
            ("mouseMoved", to, 1),
            ("mouseReleased", to, 0),
        ];
        for (kind, share, buttons) in steps {
            let event = json!({ "type": kind, "x": at(share), "y": y, "button": "left", "buttons": buttons, "clickCount": 1 });
            self.call("Input.dispatchMouseEvent", &event);
        }
    }

    /// Draws a finger across an element, from one share of its width to another.
    pub(crate) fn swipe(&mut self, selector: &str, from: f64, to: f64) {
        let selector = json!(selector);
        let place = self.value(&format!(
            "(() => {{ const node = document.querySelector({selector}); node.scrollIntoView({{ block: 'center' }});
               const box = node.getBoundingClientRect(); return [box.x, box.y + box.height / 2, box.width]; }})()"
        ));
        let [x, y, width] = [0, 1, 2].map(|index| place[index].as_f64().unwrap());
        let on = |share: f64| json!([{ "x": x + share * width, "y": y }]);
        let steps = [
            ("touchStart", on(from)),
            ("touchMove", on(f64::midpoint(from, to))),
            ("touchMove", on(to)),
            ("touchEnd", json!([])),
        ];
        for (kind, points) in steps {
            let event = json!({ "type": kind, "touchPoints": points });
            self.call("Input.dispatchTouchEvent", &event);
        }
    }

    /// As it is printed, or as it is shown.
    pub(crate) fn print(&mut self, is_printed: bool) {
        let media = if is_printed { "print" } else { "" };
        self.call("Emulation.setEmulatedMedia", &json!({ "media": media }));
    }

    /// Types into whatever has the focus.
    pub(crate) fn type_in(&mut self, text: &str) {
        self.call("Input.insertText", &json!({ "text": text }));
    }

    pub(crate) fn press(&mut self, key: &str, code: u32) {
        for kind in ["keyDown", "keyUp"] {
            let mut event =
                json!({ "type": kind, "key": key, "code": key, "windowsVirtualKeyCode": code });
            if key == "Enter" && kind == "keyDown" {
                event["text"] = json!("\r");
            }
            self.call("Input.dispatchKeyEvent", &event);
        }
    }

    /// A PNG of the window, or of the whole page.
    pub(crate) fn picture(&mut self, file: &Path, is_whole: bool) {
        let asked = json!({ "format": "png", "captureBeyondViewport": is_whole });
        let answer = self.call("Page.captureScreenshot", &asked);
        std::fs::write(file, decoded(answer["data"].as_str().unwrap())).unwrap();
    }
}

impl Drop for Chromium {
    fn drop(&mut self) {
        let _ = self.process.kill();
        let _ = self.process.wait();
    }
}

/// Base64 as the protocol writes it.
fn decoded(text: &str) -> Vec<u8> {
    let alphabet = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let (mut bits, mut count, mut bytes) = (0_u32, 0, Vec::new());
    for letter in text.bytes().filter(|letter| *letter != b'=') {
        let value = alphabet.iter().position(|one| *one == letter).unwrap();
        bits = (bits << 6) | u32::try_from(value).unwrap();
        count += 6;
        if count >= 8 {
            count -= 8;
            bytes.push(u8::try_from((bits >> count) & 0xff).unwrap());
        }
    }
    bytes
}
