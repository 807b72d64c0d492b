//! Looking at a result: selecting, hiding, deviations, measuring.

use serde_json::Value;

use super::{super::browser::Picture, ESCAPE, SHIFT, Shown, apart};

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
    shown.browser.key(ESCAPE).await;
    shown.click(14.0, 0.0, None).await;
    shown.click(0.0, 15.0, Some(SHIFT)).await;
    let told = shown.text("#card").await;
    assert!(
        told.contains("plane to axis") && (number(&told, "angle") - 90.0).abs() < 0.1,
        "{told}"
    );
}
