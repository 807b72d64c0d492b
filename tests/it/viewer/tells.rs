//! What a person knows of a face, told to the page: types, radii, merging, splitting, a part alone, and taking it back.

use serde_json::Value;

use super::{SHIFT, Shown};

impl Shown {
    /// Runs what `script` begins, and waits for its result.
    async fn runs(&self, script: &str) {
        self.browser.eval("document.getElementById('summary').replaceChildren()").await;
        self.browser.eval(script).await;
        self.browser
            .wait("document.getElementById('summary').innerText.includes('scene.ply') && document.getElementById('work').hidden")
            .await;
        assert_eq!(self.text("#problem").await, "");
    }
}

/// Chooses a type and runs.
fn make(surface_type: &str, radius: &str) -> String {
    format!(
        "(document.getElementById('tell-type').value = '{surface_type}', \
         document.getElementById('tell-type').dispatchEvent(new Event('change')), \
         document.getElementById('tell-radius').value = '{radius}', document.querySelector('#card .tell').requestSubmit())"
    )
}

#[tokio::test(flavor = "multi_thread")]
async fn a_face_is_made_another_type_and_that_is_taken_back() {
    let shown = Shown::start(&[]).await.with_scene().await;
    shown.click(14.0, 0.0, None).await;
    shown.runs(&make("cylinder", "4.01")).await;
    let told = shown.text("#told li").await;
    assert!(told.contains("is a cylinder of radius 4.01") && told.contains("done"), "{told}");
    shown.click(14.0, 0.0, None).await;
    assert!(shown.text("#card").await.contains("8.02"), "{}", shown.text("#card").await);
    // the points deny a radius that is far from theirs, and the page says so
    shown.runs(&make("cylinder", "5")).await;
    let told = shown.text("#told li:nth-child(2)").await;
    assert!(told.contains("the points deny it") && told.contains("misfit"), "{told}");
    shown.runs("document.getElementById('undo').click()").await;
    shown.click(14.0, 0.0, None).await;
    shown.runs(&make("elliptic_cylinder", "")).await;
    assert!(shown.text("#regions").await.contains("elliptic cylinder"));
    // both by key
    for left in [1, 0] {
        shown.runs("dispatchEvent(new KeyboardEvent('keydown', { key: 'z' }))").await;
        assert_eq!(shown.browser.eval("document.querySelectorAll('#told li').length").await, left);
    }
    assert!(!shown.text("#regions").await.contains("elliptic"));
    assert_eq!(shown.browser.eval("document.getElementById('steps').hidden").await, true);
    assert_eq!(shown.browser.complaints().await, Vec::<Value>::new());
}

#[tokio::test(flavor = "multi_thread")]
async fn faces_are_split_at_two_clicks_and_merged_again() {
    let shown = Shown::start(&[]).await.with_scene().await;
    shown.click(0.0, 15.0, None).await;
    shown.browser.press("[data-edit=split]").await;
    assert!(shown.text("#card").await.contains("0 so far"));
    shown.click(0.0, 14.0, None).await;
    // the ball is none of its parts
    shown.click(-10.0, 0.0, None).await;
    assert!(shown.text("#card").await.contains("1 so far"));
    shown.click(0.0, -14.0, None).await;
    shown.runs("document.querySelector('#card [data-edit=split]').click()").await;
    assert!(
        shown.text("#summary").await.contains("4 surfaces"),
        "{}",
        shown.text("#summary").await
    );
    shown.click(0.0, 14.0, None).await;
    shown.click(0.0, -14.0, Some(SHIFT)).await;
    assert_eq!(shown.selected().await.len(), 2);
    shown.runs("document.querySelector('#card [data-edit=merge]').click()").await;
    assert!(
        shown.text("#summary").await.contains("3 surfaces"),
        "{}",
        shown.text("#summary").await
    );
    // a ball and a tube are not one surface
    shown.click(-10.0, 0.0, None).await;
    shown.click(14.0, 0.0, Some(SHIFT)).await;
    shown.runs("document.querySelector('#card [data-edit=merge]').click()").await;
    assert!(shown.text("#told li:last-child").await.contains("deny"));
    assert!(shown.text("#summary").await.contains("3 surfaces"));
    // any step is taken back, not the last alone
    shown.runs("document.querySelector('#told li .off').click()").await;
    assert_eq!(shown.browser.eval("document.querySelectorAll('#told li').length").await, 2);
}

#[tokio::test(flavor = "multi_thread")]
async fn one_part_alone_is_run_and_relations_select_their_surfaces() {
    let shown = Shown::start(&[]).await.with_scene().await;
    // the tube stands upright on the plate
    let row = "[...document.querySelectorAll('#relations li')].findIndex(li => li.textContent.startsWith('perpendicular'))";
    let row = shown.browser.eval(row).await.as_i64().unwrap();
    assert!(row >= 0, "{}", shown.text("#related").await);
    shown
        .browser
        .eval(&format!("document.querySelectorAll('#relations li button')[{row}].click()"))
        .await;
    let rows = shown.selected().await;
    assert!(
        rows.len() == 2 && rows.concat().contains("plane") && rows.concat().contains("cylinder"),
        "{rows:?}"
    );
    let marked = "document.querySelectorAll('#relations button[aria-pressed=true]').length > 0";
    assert_eq!(shown.browser.eval(marked).await, true);
    // the ball, by its row
    shown.browser.eval("document.querySelectorAll('#regions .region')[1].click()").await;
    assert_eq!(shown.selected().await, ["1 sphere"]);
    shown.runs("document.querySelector('#card [data-edit=only]').click()").await;
    let told = shown.text("#found").await;
    assert!(
        told.contains("1 surface ") && told.contains("sphere") && told.contains("outside"),
        "{told}"
    );
    shown.runs("document.getElementById('undo').click()").await;
    assert!(shown.text("#summary").await.contains("3 surfaces"));
}
