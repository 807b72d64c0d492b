//! What people do with the viewer, each as they do it: with files, mouse, keys and a small screen.
//!
//! The cloud is a plate of 40 x 40 with a ball of radius 5 above (-10, 0) and a tube of radius 4 about (10, 0), seen
//! from above without perspective, so that every place on the screen is known.

use std::{f64::consts::TAU, fs, time::Duration};

use serde_json::json;

mod actions;
mod parts;
mod runs;
mod tells;

use super::{
    browser::{Browser, Picture},
    support::{Running, clouds, start},
};

/// Escape and Shift, as WebDriver calls them.
const ESCAPE: &str = "\u{e00c}";
const SHIFT: &str = "\u{e008}";

/// The cloud, and 200 points that belong to nothing, right and far above.
fn scene() -> Vec<[f64; 3]> {
    let mut state = 7_u64;
    let mut random = move || {
        state = state * 48_271 % 2_147_483_647;
        state as f64 / 2_147_483_647.0
    };
    let mut points = Vec::new();
    for _ in 0..16_000 {
        points.push([40.0 * random() - 20.0, 40.0 * random() - 20.0, 0.02 * random()]);
    }
    for _ in 0..6000 {
        let (turn, z) = (TAU * random(), 2.0 * random() - 1.0);
        let radius = 5.0 + 0.02 * random();
        let r = radius * (1.0 - z * z).sqrt();
        points.push([r * turn.cos() - 10.0, r * turn.sin(), 6.0 + radius * z]);
    }
    for _ in 0..6000 {
        let (turn, r) = (TAU * random(), 4.0 + 0.02 * random());
        points.push([10.0 + r * turn.cos(), r * turn.sin(), 12.0 * random()]);
    }
    for _ in 0..200 {
        points.push([12.0 + 6.0 * random(), 12.0 + 6.0 * random(), 20.0 + 6.0 * random()]);
    }
    points
}

/// A browser that shows the scene from above, and the pixels of a unit of length.
struct Shown {
    running: Running,
    browser: Browser,
    directory: tempfile::TempDir,
    scale: f64,
}

impl Shown {
    async fn start(flags: &[&str]) -> Self {
        let running = start(flags).await;
        let directory = tempfile::tempdir().unwrap();
        fs::write(directory.path().join("scene.ply"), clouds::ply(&scene())).unwrap();
        let browser = Browser::start().await;
        browser.call("window/rect", json!({"width": 1280, "height": 860})).await;
        browser.open(&running, "/").await;
        browser.wait("!!document.querySelector('[name=min_points]')").await;
        Self { running, browser, directory, scale: 0.0 }
    }

    /// Sends the scene and looks at it from above.
    async fn with_scene(mut self) -> Self {
        self.send("scene.ply").await;
        self.browser
            .wait("document.getElementById('summary').innerText.includes('scene.ply')")
            .await;
        for key in ["p", "4", "f"] {
            self.browser.key(key).await;
        }
        self.scale = self.seen().await.height as f64 * 0.8 / 40.0;
        self
    }

    async fn send(&self, name: &str) {
        let path = self.directory.path().join(name).display().to_string();
        self.browser.enter("#file", &path).await;
    }

    /// The view when it has come to rest, and nothing has the focus.
    async fn seen(&self) -> Picture {
        let rest = "new Promise(done => { document.activeElement.blur(); performance.clearMarks('drawn'); \
            document.getElementById('view').dispatchEvent(new Event('again')); \
            const look = () => performance.getEntriesByName('drawn').length ? setTimeout(done, 50) : setTimeout(look, 20); look(); })";
        self.browser.resolve(rest).await;
        self.browser.look("#view").await
    }

    /// Where a place of the plate is on the screen, from the middle of the view.
    fn place(&self, x: f64, y: f64) -> [f64; 2] {
        [self.scale * x, -self.scale * y]
    }

    async fn click(&self, x: f64, y: f64, held: Option<&str>) {
        self.browser.click("#view", self.place(x, y), held).await;
    }

    async fn text(&self, selector: &str) -> String {
        let script = format!("document.querySelector('{selector}')?.innerText ?? ''");
        self.browser.eval(&script).await.as_str().unwrap().to_owned()
    }

    /// The texts of the rows that are selected.
    async fn selected(&self) -> Vec<String> {
        let rows = "[...document.querySelectorAll('#regions .region[aria-pressed=true] span:first-child')].map(e => e.innerText)";
        serde_json::from_value(self.browser.eval(rows).await).unwrap()
    }

    async fn is_pressed(&self, action: &str) -> bool {
        let script = format!("document.querySelector('[data-do={action}]').ariaPressed");
        self.browser.eval(&script).await == "true"
    }

    /// Waits for a file and reads it.
    async fn saved(&self, name: &str) -> Vec<u8> {
        let path = self.directory.path().join(name);
        for _ in 0..600 {
            if let Ok(bytes) = fs::read(&path)
                && !bytes.is_empty()
            {
                return bytes;
            }
            tokio::time::sleep(Duration::from_millis(50)).await;
        }
        panic!("{} is not saved: {}", path.display(), self.text("#problem").await);
    }
}

/// How far two colours are apart.
fn apart(a: [f64; 3], b: [f64; 3]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b).abs()).sum()
}
