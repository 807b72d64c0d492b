//! The pages in a browser, driven through WebDriver. Needs `chromedriver` and Chromium, which `tests/run`
//! installs.

use std::{
    fs,
    io::{BufRead, BufReader, Read, Write},
    net::TcpStream,
    process::{Child, Command, Stdio},
    time::{Duration, Instant},
};

use serde_json::{Value, json};

use super::support::{Running, clouds, start};

/// Longest time a page may take to show what is waited for.
const PATIENCE: Duration = Duration::from_secs(60);

/// A browser with one window.
struct Browser {
    driver: Child,
    session: String,
    _profile: tempfile::TempDir,
}

impl Browser {
    async fn start() -> Self {
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

    async fn call(&self, command: &str, arguments: Value) -> Value {
        post(&format!("{}/{command}", self.session), arguments).await
    }

    /// Opens the page at `path`.
    async fn open(&self, running: &Running, path: &str) {
        self.call("url", json!({"url": running.url(path)})).await;
    }

    /// The value of a script.
    async fn eval(&self, script: &str) -> Value {
        self.call("execute/sync", json!({"script": format!("return {script}"), "args": []})).await
    }

    /// Waits until `script` is true.
    async fn wait(&self, script: &str) {
        let begin = Instant::now();
        while self.eval(script).await != true {
            let page = self.eval("document.body.innerText").await;
            assert!(begin.elapsed() < PATIENCE, "{script} stays false; the page shows {page}");
            tokio::time::sleep(Duration::from_millis(50)).await;
        }
    }

    /// What the page complained of.
    async fn complaints(&self) -> Vec<Value> {
        let log = self.call("se/log", json!({"type": "browser"})).await;
        let severe = |entry: &&Value| entry["level"] == "SEVERE";
        log.as_array().unwrap().iter().filter(severe).cloned().collect()
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
async fn the_viewer_shows_the_surfaces_of_a_file_that_is_dropped_on_it() {
    let running = start(&[]).await;
    let directory = tempfile::tempdir().unwrap();
    let file = directory.path().join("bracket.ply");
    fs::write(&file, clouds::ply(&clouds::bracket(20_000))).unwrap();
    let browser = Browser::start().await;
    browser.open(&running, "/").await;
    let found = browser.call("element", json!({"using": "css selector", "value": "#file"})).await;
    let input = found.as_object().unwrap().values().next().unwrap().as_str().unwrap().to_owned();
    let path = file.display().to_string();
    browser.call(&format!("element/{input}/value"), json!({"text": path})).await;
    browser.wait("!document.getElementById('found').hidden").await;
    let told = browser.eval("document.getElementById('found').innerText").await;
    let told = told.as_str().unwrap();
    assert!(told.contains("bracket.ply") && told.contains("cylinder"), "{told}");
    // something in colour stands in the middle of the view
    let colours = "(() => { const c = document.getElementById('view'), gl = c.getContext('webgl'); \
        return new Promise(done => requestAnimationFrame(() => { dispatchEvent(new Event('resize')); \
        const p = new Uint8Array(4 * c.width * c.height); \
        c.dispatchEvent(new MouseEvent('dblclick')); requestAnimationFrame(() => { \
        gl.readPixels(0, 0, c.width, c.height, gl.RGBA, gl.UNSIGNED_BYTE, p); \
        let n = 0; for (let i = 0; i < p.length; i += 4) n += Math.max(p[i], p[i + 1], p[i + 2]) - Math.min(p[i], p[i + 1], p[i + 2]) > 100; \
        done(n / c.width / c.height); }); })); })()";
    let share = browser.eval(colours).await.as_f64().unwrap();
    assert!(share > 0.02, "{share} of the view has colour");
    assert_eq!(browser.complaints().await, Vec::<Value>::new());
}

#[tokio::test(flavor = "multi_thread")]
async fn the_viewer_tells_why_a_file_is_refused() {
    let running = start(&[]).await;
    let browser = Browser::start().await;
    browser.open(&running, "/").await;
    browser.eval("segment(new Blob(['0 0 0']), 'one.xyz')").await;
    browser.wait("document.getElementById('problem').innerText.includes('too_few_points')").await;
}

#[tokio::test(flavor = "multi_thread")]
async fn another_run_of_the_same_cloud_takes_the_parameters_as_they_are_then() {
    let running = start(&[]).await;
    let browser = Browser::start().await;
    browser.call("window/rect", json!({"width": 1280, "height": 850})).await;
    browser.open(&running, "/").await;
    browser.wait("!!document.querySelector('[name=min_points]')").await;
    browser.eval("(document.querySelector('details').open = true, segment(new Blob([[...Array(900).keys()]\
        .map(i => `${i % 30} ${i / 30 | 0} 0`).join('\\n')]), 'plate.xyz'))").await;
    browser.wait("!document.getElementById('found').hidden").await;
    // what was found stays in sight beside the open form
    let inside = "(e => e.top >= 0 && e.bottom <= innerHeight)(document.getElementById('summary').getBoundingClientRect())";
    browser.wait(inside).await;
    browser
        .eval("(document.querySelector('[name=min_points]').value = '901', document.getElementById('again').click())")
        .await;
    browser.wait("document.getElementById('problem').innerText.includes('too_few_points')").await;
    // what the view showed was another run's
    browser
        .wait(
            "document.getElementById('found').hidden && !document.body.classList.contains('shown')",
        )
        .await;
    browser.eval("(document.querySelector('[name=min_points]').value = '', document.getElementById('again').click())").await;
    browser.wait("document.getElementById('summary').innerText.includes('plate.xyz')").await;
    assert_eq!(browser.complaints().await, Vec::<Value>::new());
}

#[tokio::test(flavor = "multi_thread")]
async fn the_reference_lists_every_operation_schema_and_code() {
    let running = start(&[]).await;
    let browser = Browser::start().await;
    browser.open(&running, "/docs#too_few_points").await;
    browser.wait("document.getElementById('codes').rows.length > 10").await;
    assert_eq!(browser.eval("document.querySelectorAll('#operations section').length").await, 8);
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
