//! What people do with the viewer, each as they do it: with files, mouse, keys and a small screen.
//!
//! The cloud is a plate of 40 x 40 with a ball of radius 5 above (-10, 0) and a tube of radius 4 about (10, 0), seen
//! from above without perspective, so that every place on the screen is known.

use std::{f64::consts::TAU, fs, path::Path, time::Duration};

use conicoid::service::sha256;
use serde_json::{Value, json};

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
        let rows = "[...document.querySelectorAll('.region[aria-pressed=true] span:first-child')].map(e => e.innerText)";
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

#[tokio::test(flavor = "multi_thread")]
async fn a_face_that_is_clicked_is_selected_in_view_and_list() {
    let shown = Shown::start(&[]).await.with_scene().await;
    let before = shown.seen().await;
    for ((x, y), kind) in
        [((-10.0, 0.0), "sphere"), ((15.0, -15.0), "plane"), ((14.0, 0.0), "cylinder")]
    {
        shown.click(x, y, None).await;
        let rows = shown.selected().await;
        assert!(rows.len() == 1 && rows[0].contains(kind), "{kind}: {rows:?}");
        assert!(shown.text("#card h2").await.contains(kind));
    }
    // the others stand back: the tube is selected, and the plate is grey
    let now = shown.seen().await;
    assert!(apart(before.mean(shown.place(0.0, -10.0)), now.mean(shown.place(0.0, -10.0))) > 60.0);
    // a second click, and one on nothing, select nothing
    shown.click(14.0, 0.0, None).await;
    assert_eq!(shown.selected().await.len(), 0);
    shown.click(-10.0, 0.0, None).await;
    shown.click(23.0, 0.0, None).await;
    assert_eq!(shown.selected().await.len(), 0);
    assert!(shown.seen().await.is(&before));
    // the list selects as well, and the keys go through it
    shown.browser.press("#regions li:nth-child(2) .region").await;
    assert!(shown.selected().await[0].starts_with("1 "));
    shown.browser.key("n").await;
    assert!(shown.selected().await[0].starts_with("2 "));
    shown.browser.key("b").await;
    assert!(shown.selected().await[0].starts_with("1 "));
    shown.browser.key(ESCAPE).await;
    assert_eq!(shown.selected().await.len(), 0);
    assert_eq!(shown.browser.complaints().await, Vec::<Value>::new());
}

#[tokio::test(flavor = "multi_thread")]
async fn faces_are_hidden_isolated_and_shown_again() {
    let shown = Shown::start(&[]).await.with_scene().await;
    let before = shown.seen().await;
    let (ball, plate) = (shown.place(-10.0, 0.0), shown.place(0.0, -12.0));
    shown.click(-10.0, 0.0, None).await;
    shown.browser.key("h").await;
    let hidden = shown.seen().await;
    // the plate is seen where the ball was
    assert!(apart(hidden.mean(ball), before.mean(plate)) < 40.0, "{:?}", hidden.mean(ball));
    assert!(apart(hidden.mean(ball), before.mean(ball)) > 60.0);
    // and what is hidden is not hit
    shown.click(-10.0, 0.0, None).await;
    assert!(shown.selected().await[0].contains("plane"));
    shown.browser.press("[data-do=isolate]").await;
    shown.browser.key(ESCAPE).await;
    let alone = shown.seen().await;
    let tube = shown.place(14.0, 0.0);
    assert!(apart(alone.mean(tube), before.mean(tube)) > 60.0);
    let gone = "document.querySelectorAll('#regions li.gone').length";
    assert_eq!(shown.browser.eval(gone).await, 3);
    shown.browser.key("u").await;
    let unassigned = shown.seen().await;
    assert_eq!(unassigned.mean(plate), [255.0; 3]);
    assert!(shown.is_pressed("unassigned").await);
    // something is left, above the plate's corner
    let corner = shown.place(15.0, 15.0);
    let grey = (-60..60).flat_map(|x| (-60..60).map(move |y| (x, y)));
    let grey = grey.filter(|(x, y)| {
        unassigned.at([corner[0] + f64::from(*x), corner[1] + f64::from(*y)])[0] < 200
    });
    assert!(grey.count() > 200);
    shown.browser.press("[data-do=all]").await;
    assert!(shown.seen().await.is(&before));
    // one by its own switch
    shown.browser.press("#regions li:nth-child(1) .eye").await;
    assert_eq!(shown.browser.eval(gone).await, 1);
    shown.browser.key("a").await;
    assert_eq!(shown.browser.eval(gone).await, 0);
}

#[tokio::test(flavor = "multi_thread")]
async fn deviations_have_colours_with_a_scale_and_a_histogram() {
    let shown = Shown::start(&[]).await.with_scene().await;
    let before = shown.seen().await;
    shown.browser.key("d").await;
    assert!(shown.is_pressed("deviations").await && !shown.is_pressed("surfaces").await);
    let now = shown.seen().await;
    // even noise about the plate: as much blue as red, no more of the surface's own colour
    let ([r, _, b], own) =
        (now.mean(shown.place(0.0, -12.0)), before.mean(shown.place(0.0, -12.0)));
    assert!((r - b).abs() < 60.0 && apart([r, r, b], own) > 60.0, "{r} {b} {own:?}");
    let bars = "[...document.querySelectorAll('#card svg rect')].map(bar => Number(bar.getAttribute('height')))";
    let bars: Vec<f64> = serde_json::from_value(shown.browser.eval(bars).await).unwrap();
    assert!(bars.len() == 41 && bars.iter().all(|bar| *bar >= 0.0));
    assert!(bars[20] > 0.0 && bars[0] < 0.2 * bars[20], "{bars:?}");
    // a tenth of the scale makes the colours deep
    let reach = "Number(document.getElementById('reach').value)";
    let wide = shown.browser.eval(reach).await.as_f64().unwrap();
    assert!(wide > 0.005 && wide < 0.1, "{wide}");
    shown.browser.eval("(document.getElementById('reach').value = '0.0001', document.getElementById('reach').dispatchEvent(new Event('change')))").await;
    let deep = shown.seen().await;
    let grey = |picture: &Picture| {
        let place = shown.place(0.0, -12.0);
        let all = (-20..20).flat_map(|x| (-20..20).map(move |y| [x, y]));
        let chroma = all.map(|[x, y]| {
            let [r, _, b] = picture.at([place[0] + f64::from(x), place[1] + f64::from(y)]);
            (f64::from(r) - f64::from(b)).abs()
        });
        chroma.sum::<f64>() / 1600.0
    };
    assert!(grey(&deep) > 1.3 * grey(&now), "{} {}", grey(&deep), grey(&now));
    // one surface has a histogram of its own
    shown.click(-10.0, 0.0, None).await;
    let told = shown.text("#card").await;
    assert!(told.contains("sphere") && told.contains("rms") && told.contains("mean"), "{told}");
    shown.browser.press("[data-do=surfaces]").await;
    shown.browser.key(ESCAPE).await;
    assert!(shown.seen().await.is(&before));
}

/// The number behind a name in a list of facts.
fn number(text: &str, name: &str) -> f64 {
    let rest = text.split(name).nth(1).unwrap_or_else(|| panic!("no {name} in {text}"));
    rest.trim().split([' ', '\n', '°']).next().unwrap().parse().unwrap()
}

#[tokio::test(flavor = "multi_thread")]
async fn two_points_and_two_surfaces_are_measured() {
    let shown = Shown::start(&[]).await.with_scene().await;
    shown.browser.key("m").await;
    shown.click(-15.0, 15.0, None).await;
    assert!(shown.text("#card").await.contains("second point"));
    shown.click(15.0, -15.0, None).await;
    let told = shown.text("#card").await;
    // points lie 0.3 apart, and the nearest to each click is taken
    let far = number(&told, "Distance");
    assert!((far - 30.0 * 2f64.sqrt()).abs() < 0.5, "{told}");
    let parts: Vec<f64> = told
        .split("along x, y, z")
        .nth(1)
        .unwrap()
        .trim()
        .lines()
        .next()
        .unwrap()
        .split(", ")
        .map(|part| part.parse().unwrap())
        .collect();
    assert!(
        (parts[0] - 30.0).abs() < 0.6 && (parts[1] + 30.0).abs() < 0.6 && parts[2].abs() < 0.03,
        "{told}"
    );
    assert_eq!(parts.iter().map(|p| p * p).sum::<f64>().sqrt().round(), far.round());
    shown.browser.key(ESCAPE).await;
    assert!(!shown.is_pressed("measure").await);
    // the ball's centre is 20 from the tube's axis
    shown.click(-10.0, 0.0, None).await;
    shown.click(14.0, 0.0, Some(SHIFT)).await;
    assert_eq!(shown.selected().await.len(), 2);
    let told = shown.text("#card").await;
    assert!(
        told.contains("axis to centre") && (number(&told, "distance") - 20.0).abs() < 0.005,
        "{told}"
    );
    // the tube stands upright on the plate
    shown.click(-10.0, 0.0, Some(SHIFT)).await;
    shown.click(0.0, -15.0, Some(SHIFT)).await;
    let told = shown.text("#card").await;
    assert!(
        told.contains("plane to axis") && (number(&told, "angle") - 90.0).abs() < 0.1,
        "{told}"
    );
}

#[tokio::test(flavor = "multi_thread")]
async fn every_form_of_the_result_is_saved_from_what_is_always_in_sight() {
    let shown = Shown::start(&[]).await;
    let buttons =
        "[...document.querySelectorAll('#saves button')].map(b => [b.innerText, b.disabled])";
    let before = shown.browser.eval(buttons).await;
    assert!(before.as_array().unwrap().iter().all(|button| button[1] == true), "{before}");
    let place = shown.directory.path().display().to_string();
    shown
        .browser
        .tell("Browser.setDownloadBehavior", json!({"behavior": "allow", "downloadPath": place}))
        .await;
    let shown = shown.with_scene().await;
    let inside = "(e => e.top >= 0 && e.bottom <= innerHeight)(document.getElementById('saves').getBoundingClientRect())";
    assert_eq!(shown.browser.eval(inside).await, true);
    let names: Vec<(String, bool)> =
        serde_json::from_value(shown.browser.eval(buttons).await).unwrap();
    for (k, (name, disabled)) in names.iter().enumerate() {
        assert!(!disabled, "{name}");
        shown.browser.press(&format!("#saves button:nth-of-type({})", k + 1)).await;
        let path = match name.as_str() {
            "Report" => "scene-surfaces.html".to_owned(),
            "Picture" => "scene.png".to_owned(),
            other => format!("scene-surfaces.{}", other.to_lowercase()),
        };
        let bytes = shown.saved(&path).await;
        match name.as_str() {
            "JSON" => {
                let document: Value = serde_json::from_slice(&bytes).unwrap();
                assert_eq!(document["labels"].as_array().unwrap().len(), scene().len());
            }
            "CSV" => assert!(bytes.starts_with(b"id,type,")),
            "PLY" => assert!(bytes.starts_with(b"ply\n")),
            "STEP" => assert!(bytes.starts_with(b"ISO-10303-21;")),
            "Report" => assert!(String::from_utf8(bytes).unwrap().contains("<h1>scene.ply</h1>")),
            "Picture" => {
                // what is seen, with the axes and the scale over it
                let (picture, seen) = (Picture::of(&bytes), shown.seen().await);
                assert_eq!((picture.width, picture.height), (seen.width, seen.height));
                let ball = shown.place(-10.0, 0.0);
                assert!(apart(picture.mean(ball), seen.mean(ball)) < 3.0);
            }
            other => panic!("{other} is not known"),
        }
    }
    for name in ["JSON", "CSV", "PLY", "Report", "Picture"] {
        assert!(names.iter().any(|(known, _)| known == name), "{name}");
    }
    assert_eq!(shown.browser.complaints().await, Vec::<Value>::new());
}

#[tokio::test(flavor = "multi_thread")]
async fn another_run_keeps_camera_and_colours_and_an_error_keeps_the_scene() {
    let shown = Shown::start(&[]).await.with_scene().await;
    shown.browser.press("#asked summary").await;
    for found in ["tolerance", "noise_sigma"] {
        let told = shown.text(&format!("#found-{found}")).await;
        assert!(told.starts_with("found 0.0"), "{told}");
    }
    // as nobody stands by default
    for key in ["\u{e012}", "\u{e015}", "+"] {
        shown.browser.click("#view", shown.place(-23.0, 18.0), None).await;
        shown.browser.key(key).await;
    }
    let before = shown.seen().await;
    shown.browser.enter("[name=min_points]", "100").await;
    shown.browser.eval("document.getElementById('summary').replaceChildren()").await;
    shown.browser.press("#again").await;
    shown.browser.wait("document.getElementById('summary').innerText.includes('scene.ply')").await;
    assert!(shown.seen().await.is(&before));
    // more points than there are
    shown.browser.enter("[name=min_points]", "000").await;
    shown.browser.press("#again").await;
    shown
        .browser
        .wait("document.getElementById('problem').innerText.includes('too_few_points')")
        .await;
    assert!(shown.text("#problem").await.contains("the result before"));
    assert!(shown.seen().await.is(&before));
    assert!(shown.text("#summary").await.contains("3 surfaces"));
    // the type that was left out is not found, and the others keep their colours
    shown.browser.eval("(document.querySelector('[name=min_points]').value = '', document.querySelector('[value=sphere]').click(), \
        document.querySelector('[value=ellipsoid]').click(), document.querySelector('[value=torus]').click())").await;
    shown.browser.press("#again").await;
    shown.browser.wait("!document.getElementById('regions').innerText.includes('sphere') && document.getElementById('problem').hidden").await;
    for key in ["4", "f"] {
        shown.browser.key(key).await;
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn colours_of_a_plate_stay_when_another_surface_is_gone() {
    let shown = Shown::start(&[]).await.with_scene().await;
    let color = "Object.fromEntries([...document.querySelectorAll('#regions li')].map(li => \
        [li.innerText.split(/[ ,\\n]/)[1], li.querySelector('.eye').style.getPropertyValue('--color')]))";
    let before = shown.browser.eval(color).await;
    shown.browser.press("#asked summary").await;
    // the plate has most points: without planes the others move up in the list
    shown.browser.eval("document.querySelector('fieldset [value=plane]').click()").await;
    shown.browser.press("#again").await;
    shown.browser.wait("!document.getElementById('regions').innerText.includes('plane')").await;
    let after = shown.browser.eval(color).await;
    assert_eq!(before["sphere"], after["sphere"], "{before} {after}");
    assert_eq!(before["cylinder"], after["cylinder"], "{before} {after}");
}

#[tokio::test(flavor = "multi_thread")]
async fn a_file_is_read_as_the_format_that_is_chosen_and_the_refusal_is_told() {
    let shown = Shown::start(&[]).await;
    fs::write(shown.directory.path().join("one.xyz"), "0 0 0\n").unwrap();
    shown.send("one.xyz").await;
    shown
        .browser
        .wait("document.getElementById('problem').innerText.includes('too_few_points')")
        .await;
    assert_eq!(shown.browser.eval("document.body.classList.contains('shown')").await, false);
    shown.browser.press("#asked summary").await;
    let choose =
        |format: &str| format!("document.querySelector('[name=format]').value = '{format}'");
    shown.browser.eval(&choose("stl")).await;
    shown.send("scene.ply").await;
    shown.browser.wait("document.getElementById('problem').innerText.includes('named stl')").await;
    shown.browser.eval(&choose("ply")).await;
    shown.browser.press("#again").await;
    shown.browser.wait("document.getElementById('summary').innerText.includes('scene.ply')").await;
    assert_eq!(shown.browser.eval("document.getElementById('problem').hidden").await, true);
}

#[tokio::test(flavor = "multi_thread")]
async fn a_service_with_keys_asks_for_one_until_it_is_right() {
    let directory = tempfile::tempdir().unwrap();
    let keys = directory.path().join("keys");
    fs::write(&keys, format!("scanner {}\n", sha256(b"secret"))).unwrap();
    let shown = Shown::start(&[&format!("--keys={}", keys.display())]).await;
    let is_open = "document.getElementById('key').open";
    shown.send("scene.ply").await;
    shown.browser.wait(is_open).await;
    shown.browser.press("#key-cancel").await;
    shown
        .browser
        .wait("document.getElementById('problem').innerText.includes('unauthenticated')")
        .await;
    shown.browser.press("#again").await;
    shown.browser.wait(is_open).await;
    shown.browser.enter("#key-value", "wrong\u{e007}").await;
    shown
        .browser
        .wait(
            "document.getElementById('key').open && !document.getElementById('key-refused').hidden",
        )
        .await;
    shown.browser.enter("#key-value", "secret").await;
    shown.browser.press("#key-form .main").await;
    shown.browser.wait("document.getElementById('summary').innerText.includes('scene.ply')").await;
    // it is asked for once, and written nowhere
    assert_eq!(
        shown
            .browser
            .eval("document.cookie + JSON.stringify({...localStorage, ...sessionStorage})")
            .await,
        "{}"
    );
    assert_eq!(shown.browser.eval("document.getElementById('key-value').value").await, "secret");
    shown.browser.press("#again").await;
    shown.browser.wait("document.getElementById('work').hidden").await;
    assert_eq!(shown.browser.eval(is_open).await, false);
}

#[tokio::test(flavor = "multi_thread")]
async fn the_page_is_dark_where_the_system_is_and_fits_a_telephone() {
    let shown = Shown::start(&[]).await.with_scene().await;
    let outside = shown.place(-23.0, 0.0);
    assert_eq!(shown.seen().await.mean(outside), [255.0; 3]);
    let dark = json!({"features": [{"name": "prefers-color-scheme", "value": "dark"}]});
    shown.browser.tell("Emulation.setEmulatedMedia", dark).await;
    assert!(shown.seen().await.mean(outside).iter().all(|c| *c < 40.0));
    let phone = json!({"width": 390, "height": 844, "deviceScaleFactor": 1, "mobile": true});
    shown.browser.tell("Emulation.setDeviceMetricsOverride", phone).await;
    shown
        .browser
        .wait("innerWidth === 390 && document.documentElement.scrollWidth <= innerWidth")
        .await;
    for id in ["view", "saves"] {
        let inside = format!(
            "(e => e.top >= 0 && e.bottom <= innerHeight && e.width > 300)(document.getElementById('{id}').getBoundingClientRect())"
        );
        shown.browser.wait(&inside).await;
    }
    // the view stays while the list goes by
    shown.browser.eval("scrollTo(0, 10000)").await;
    shown.browser.wait("document.getElementById('view').getBoundingClientRect().top === 0").await;
}

#[tokio::test(flavor = "multi_thread")]
async fn the_page_loads_from_this_service_alone_and_runs_no_text_of_its_own() {
    let shown = Shown::start(&[]).await.with_scene().await;
    let page = reqwest::get(shown.running.url("/")).await.unwrap();
    let policy = page.headers()["content-security-policy"].to_str().unwrap().to_owned();
    assert!(policy.contains("default-src 'none'") && !policy.contains("unsafe"), "{policy}");
    let foreign = "performance.getEntriesByType('resource').map(e => e.name).filter(n => !n.startsWith(location.origin) && !n.startsWith('data:') && !n.startsWith('blob:'))";
    assert_eq!(shown.browser.eval(foreign).await, json!([]));
    // a script that is put into it is not run
    shown.browser.eval("document.body.append(Object.assign(document.createElement('script'), { textContent: 'window.foreign = 1' }))").await;
    assert_eq!(shown.browser.eval("window.foreign === undefined").await, true);
    // every file of the page is served as what it is, and none but these
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("src/http/pages/viewer");
    for file in fs::read_dir(folder).unwrap() {
        let name = file.unwrap().file_name().into_string().unwrap();
        let answer = reqwest::get(shown.running.url(&format!("/viewer/{name}"))).await.unwrap();
        if name == "viewer.html" {
            assert_eq!(answer.status(), 404);
            continue;
        }
        let kind = if name.ends_with("css") { "text/css" } else { "text/javascript" };
        assert!(answer.headers()["content-type"].to_str().unwrap().starts_with(kind), "{name}");
        assert_eq!(answer.headers()["x-content-type-options"], "nosniff");
    }
    let away = reqwest::get(shown.running.url("/viewer/..%2fdocs.html")).await.unwrap();
    assert_eq!(away.status(), 404);
}

#[tokio::test(flavor = "multi_thread")]
async fn the_keys_are_listed_and_do_not_act_while_somebody_types() {
    let shown = Shown::start(&[]).await.with_scene().await;
    shown.browser.key("?").await;
    shown.browser.wait("document.getElementById('keys').open").await;
    shown.browser.key("d").await;
    assert!(!shown.is_pressed("deviations").await);
    shown.browser.press("#keys-close").await;
    shown.browser.press("#asked summary").await;
    shown.browser.enter("[name=connectivity]", "d").await;
    assert!(!shown.is_pressed("deviations").await);
    assert_eq!(
        shown.browser.eval("document.querySelector('[name=connectivity]').value").await,
        "d"
    );
}
