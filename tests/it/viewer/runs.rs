//! Runs one after another, saving, keys, formats, themes and small screens, and what the page may load.

use std::{fs, path::Path};

use conicoid::service::sha256;
use serde_json::{Value, json};

use super::{super::browser::Picture, Shown, apart, scene};

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
