//! The pages in a browser, driven through WebDriver. Needs `chromedriver` and Chromium, which `tests/run`
//! installs.

use std::{
    io::{BufRead, BufReader, Read, Write},
    net::TcpStream,
    process::{Child, Command, Stdio},
    time::{Duration, Instant},
};

use base64::{Engine, prelude::BASE64_STANDARD};
use serde_json::{Value, json};

use super::support::{Running, start};

/// Longest time a page may take to show what is waited for.
const PATIENCE: Duration = Duration::from_secs(60);

/// A browser with one window.
pub struct Browser {
    driver: Child,
    session: String,
    _profile: tempfile::TempDir,
}

impl Browser {
    pub async fn start() -> Self {
        let mut command = Command::new("chromedriver");
        let driver = command.arg("--port=0").stdout(Stdio::piped()).spawn();
        let mut driver = driver.expect("chromedriver is there: tests/run installs it");
        let lines = BufReader::new(driver.stdout.take().unwrap()).lines();
        let port = lines.map_while(Result::ok).find_map(|line| {
            Some(
                line.split("started successfully on port ")
                    .nth(1)?
                    .trim_end_matches('.')
                    .to_owned(),
            )
        });
        let base = format!("http://127.0.0.1:{}/session", port.unwrap());
        let profile = tempfile::tempdir().unwrap();
        let user_data = format!("--user-data-dir={}", profile.path().display());
        let flags = [
            "--headless",
            "--no-sandbox",
            "--disable-gpu",
            "--enable-unsafe-swiftshader",
            "--use-angle=swiftshader",
            "--disable-quic",
            "--no-first-run",
            "--disable-background-networking",
            "--disable-component-update",
            "--disable-sync",
            &user_data,
        ];
        let wanted = json!({"alwaysMatch": {
            "goog:chromeOptions": {"args": flags}, "goog:loggingPrefs": {"browser": "ALL"}
        }});
        let made = post(&base, json!({ "capabilities": wanted })).await;
        let session = format!("{base}/{}", made["sessionId"].as_str().unwrap());
        Self { driver, session, _profile: profile }
    }

    pub async fn call(&self, command: &str, arguments: Value) -> Value {
        post(&format!("{}/{command}", self.session), arguments).await
    }

    /// Opens the page at `path`.
    pub async fn open(&self, running: &Running, path: &str) {
        self.call("url", json!({"url": running.url(path)})).await;
    }

    /// The value of a script.
    pub async fn eval(&self, script: &str) -> Value {
        self.call("execute/sync", json!({"script": format!("return {script}"), "args": []})).await
    }

    /// The value of a promise.
    pub async fn resolve(&self, script: &str) -> Value {
        let script = format!(
            "const done = arguments[0]; ({script}).then(done, error => done(String(error)))"
        );
        self.call("execute/async", json!({"script": script, "args": []})).await
    }

    /// The first element of a selector, as WebDriver names it.
    pub async fn element(&self, selector: &str) -> Value {
        self.call("element", json!({"using": "css selector", "value": selector})).await
    }

    async fn on_element(&self, selector: &str, command: &str, arguments: Value) -> Value {
        let element = self.element(selector).await;
        let name =
            element.as_object().unwrap().values().next().unwrap().as_str().unwrap().to_owned();
        self.call(&format!("element/{name}/{command}"), arguments).await
    }

    /// Clicks an element.
    pub async fn press(&self, selector: &str) {
        self.on_element(selector, "click", json!({})).await;
    }

    /// Types into an element, or chooses a file where it is for files.
    pub async fn enter(&self, selector: &str, text: &str) {
        self.on_element(selector, "value", json!({ "text": text })).await;
    }

    /// Presses and releases a key.
    pub async fn key(&self, key: &str) {
        let down_and_up =
            json!([{"type": "keyDown", "value": key}, {"type": "keyUp", "value": key}]);
        self.call(
            "actions",
            json!({"actions": [{"type": "key", "id": "keys", "actions": down_and_up}]}),
        )
        .await;
    }

    /// Clicks so far from the middle of an element, to the right and down, with a key held where there is one.
    pub async fn click(&self, selector: &str, [x, y]: [f64; 2], held: Option<&str>) {
        let origin = self.element(selector).await;
        let (x, y) = (x.round() as i64, y.round() as i64);
        let mut actions = vec![
            json!({"type": "pointer", "id": "mouse", "parameters": {"pointerType": "mouse"}, "actions": [
                {"type": "pause", "duration": 0},
                {"type": "pointerMove", "origin": origin, "x": x, "y": y},
                {"type": "pointerDown", "button": 0}, {"type": "pointerUp", "button": 0},
            ]}),
        ];
        if let Some(key) = held {
            actions.push(json!({"type": "key", "id": "keys", "actions": [
                {"type": "keyDown", "value": key}, {"type": "pause", "duration": 0},
                {"type": "pause", "duration": 0}, {"type": "pause", "duration": 0}, {"type": "keyUp", "value": key},
            ]}));
        }
        self.call("actions", json!({ "actions": actions })).await;
    }

    /// A command of the browser's own protocol.
    pub async fn tell(&self, command: &str, parameters: Value) {
        self.call("goog/cdp/execute", json!({"cmd": command, "params": parameters})).await;
    }

    /// What an element looks like: width, height, and red, green, blue of each pixel.
    pub async fn look(&self, selector: &str) -> Picture {
        let element = self.element(selector).await;
        let name =
            element.as_object().unwrap().values().next().unwrap().as_str().unwrap().to_owned();
        let url = format!("{}/element/{name}/screenshot", self.session);
        let told: Value = reqwest::get(url).await.unwrap().json().await.unwrap();
        Picture::of(&BASE64_STANDARD.decode(told["value"].as_str().unwrap()).unwrap())
    }

    /// Waits until `script` is true.
    pub async fn wait(&self, script: &str) {
        let begin = Instant::now();
        while self.eval(script).await != true {
            let page = self.eval("document.body.innerText").await;
            assert!(begin.elapsed() < PATIENCE, "{script} stays false; the page shows {page}");
            tokio::time::sleep(Duration::from_millis(50)).await;
        }
    }

    /// What the page complained of.
    pub async fn complaints(&self) -> Vec<Value> {
        let log = self.call("se/log", json!({"type": "browser"})).await;
        let severe = |entry: &&Value| entry["level"] == "SEVERE";
        log.as_array().unwrap().iter().filter(severe).cloned().collect()
    }
}

/// A decoded PNG file.
pub struct Picture {
    pub width: usize,
    pub height: usize,
    pixels: Vec<[u8; 3]>,
}

impl Picture {
    /// Decodes a file of eight bits a channel.
    pub fn of(bytes: &[u8]) -> Self {
        let mut reader = png::Decoder::new(std::io::Cursor::new(bytes)).read_info().unwrap();
        let mut data = vec![0; reader.output_buffer_size().unwrap()];
        let frame = reader.next_frame(&mut data).unwrap();
        let pixels = data[..frame.buffer_size()].chunks(frame.color_type.samples());
        let pixels = pixels.map(|pixel| [pixel[0], pixel[1], pixel[2]]).collect();
        Self { width: frame.width as usize, height: frame.height as usize, pixels }
    }

    /// Whether it is the same but for one pixel in a thousand.
    pub fn is(&self, other: &Self) -> bool {
        let differ = self.pixels.iter().zip(&other.pixels).filter(|(a, b)| a != b).count();
        self.pixels.len() == other.pixels.len() && 1000 * differ <= self.pixels.len()
    }

    /// The pixel so far from the middle, to the right and down.
    pub fn at(&self, [x, y]: [f64; 2]) -> [u8; 3] {
        let (x, y) = (self.width as f64 / 2.0 + x, self.height as f64 / 2.0 + y);
        self.pixels[y as usize * self.width + x as usize]
    }

    /// The mean over a square of pixels about a place: that of an area, whatever its noise.
    pub fn mean(&self, [x, y]: [f64; 2]) -> [f64; 3] {
        const HALF: i32 = 4;
        let mut sum = [0.0; 3];
        for dy in -HALF..=HALF {
            for dx in -HALF..=HALF {
                let pixel = self.at([x + f64::from(dx), y + f64::from(dy)]);
                sum.iter_mut().zip(pixel).for_each(|(s, p)| *s += f64::from(p));
            }
        }
        sum.map(|s| s / f64::from((2 * HALF + 1) * (2 * HALF + 1)))
    }
}

impl Drop for Browser {
    fn drop(&mut self) {
        // the end of the session is the end of the browser; the driver alone would leave it behind
        let (address, path) = self.session.trim_start_matches("http://").split_once('/').unwrap();
        if let Ok(mut stream) = TcpStream::connect(address) {
            let head =
                format!("DELETE /{path} HTTP/1.1\r\nHost: {address}\r\nConnection: close\r\n\r\n");
            let _ = stream.write_all(head.as_bytes());
            // the answer comes when the browser has ended; the connection stays open
            let _ = stream.set_read_timeout(Some(Duration::from_secs(10)));
            let _ = stream.read(&mut [0; 512]);
        }
        let _ = self.driver.kill();
        let _ = self.driver.wait();
    }
}

async fn post(url: &str, arguments: Value) -> Value {
    let answer = reqwest::Client::new().post(url).json(&arguments).send().await.unwrap();
    let answer: Value = answer.json().await.unwrap();
    assert!(answer["value"]["error"].is_null(), "{url}: {answer}");
    answer["value"].clone()
}

#[tokio::test(flavor = "multi_thread")]
async fn the_reference_lists_every_operation_schema_and_code() {
    let running = start(&[]).await;
    let browser = Browser::start().await;
    browser.open(&running, "/docs#too_few_points").await;
    browser.wait("document.getElementById('codes').rows.length > 10").await;
    let contract: Value =
        reqwest::get(running.url("/openapi.json")).await.unwrap().json().await.unwrap();
    let paths = contract["paths"].as_object().unwrap().values();
    let operations: usize = paths.map(|path| path.as_object().unwrap().len()).sum();
    assert!(operations > 10);
    let sections = browser.eval("document.querySelectorAll('#operations section').length");
    assert_eq!(sections.await, operations);
    assert_eq!(browser.eval("document.getElementById('too_few_points').className").await, "here");
    let missing = browser
        .eval("['not_found', 'method_not_allowed'].filter(c => !document.getElementById(c))");
    assert_eq!(missing.await, json!([]));
    // no cell that should say something is empty
    let empty = "[...document.querySelectorAll('main td')].filter(e => !e.innerText.trim()).length";
    assert_eq!(browser.eval(empty).await, 0);
    // and it is no wider than a telephone's screen
    browser.call("window/rect", json!({"width": 500, "height": 800})).await;
    browser.wait("innerWidth <= 500 && document.documentElement.scrollWidth <= innerWidth").await;
    let broken = "[...document.querySelectorAll('a[href^=\"#\"]')].filter(a => \
        !document.getElementById(a.getAttribute('href').slice(1))).map(a => a.href)";
    assert_eq!(browser.eval(broken).await, json!([]));
    assert_eq!(browser.complaints().await, Vec::<Value>::new());
}
