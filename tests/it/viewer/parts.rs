//! The parts of the viewer that reckon, against answers known otherwise. They run in the browser, as on the page.

use serde_json::{Value, json};

use super::super::{
    browser::Browser,
    support::{Running, start},
};

struct Parts {
    running: Running,
    browser: Browser,
}

impl Parts {
    async fn start() -> Self {
        let running = start(&[]).await;
        let browser = Browser::start().await;
        browser.open(&running, "/").await;
        Self { running, browser }
    }

    /// The value of `script`, in which `part` is a file of the viewer.
    async fn of(&self, part: &str, script: &str) -> Value {
        let url = self.running.url(&format!("/viewer/{part}.js"));
        self.browser.resolve(&format!("import('{url}').then(part => ({script}))")).await
    }
}

fn numbers(value: &Value) -> Vec<f64> {
    value
        .as_array()
        .unwrap_or_else(|| panic!("{value}"))
        .iter()
        .map(|n| n.as_f64().unwrap())
        .collect()
}

#[tokio::test(flavor = "multi_thread")]
async fn numbers_have_the_digits_that_their_uncertainty_deserves() {
    let parts = Parts::start().await;
    for (script, text) in [
        ("part.exact(12.340123, 0.0123)", "12.340 ± 0.012"),
        ("part.exact(12345.6, 230)", "12346 ± 230"),
        ("part.exact(1 / 3)", "0.33333"),
        ("part.exact(25, 0)", "25"),
        ("part.number(1.23456e-9)", "1.2346e-9"),
        ("part.number(100)", "100"),
        ("part.degrees(Math.PI / 3, 0.001)", "60.000 ± 0.057°"),
        ("part.vector([1, -0.0000001, 1000])", "(1.0, 0.0, 1000.0)"),
    ] {
        assert_eq!(parts.of("text", script).await, text, "{script}");
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn a_region_is_told_as_the_report_tells_it() {
    let parts = Parts::start().await;
    let region = "{ type: 'cone', side: 'hole', full_angle: Math.PI / 3, end_radii: [1.5, 3], length: 4, swept_angle: Math.PI, \
        share_seen: null, uncertainty: { half_angle: 0.001, length: 0.02 } }";
    let told = parts.of("text", &format!("[part.kind({region}), part.dimensions({region})]")).await;
    let all = json!([
        ["full angle", "60.00 ± 0.11°"],
        ["end diameters", "3 to 6"],
        ["length", "4.000 ± 0.020"],
        ["swept", "180°"]
    ]);
    assert_eq!(told, json!(["cone, hole", all]));
}

#[tokio::test(flavor = "multi_thread")]
async fn distances_and_angles_between_surfaces_are_those_of_geometry() {
    let parts = Parts::start().await;
    let plane = |z: f64, tilt: f64| {
        format!(
            "{{ type: 'plane', surface: {{ point: [7, 8, {z}], normal: [Math.sin({tilt}), 0, Math.cos({tilt})] }} }}"
        )
    };
    let tube = |x: f64, d: &str| {
        format!(
            "{{ type: 'cylinder', surface: {{ axis_point: [{x}, 0, 5], axis_direction: {d}, radius: 1 }} }}"
        )
    };
    let ball =
        |x: f64| format!("{{ type: 'sphere', surface: {{ center: [{x}, 4, 0], radius: 1 }} }}");
    for (a, b, what, distance, angle) in [
        (plane(0.0, 0.0), plane(3.0, 0.0), "plane to plane", Some(3.0), Some(0.0)),
        (plane(0.0, 0.0), plane(3.0, 0.5), "plane to plane", None, Some(0.5)),
        // parallel axes 5 apart, axes that cross at a right angle 2 above each other, and ones that meet
        (tube(0.0, "[0, 0, 1]"), tube(5.0, "[0, 0, -1]"), "axis to axis", Some(5.0), Some(0.0)),
        (
            tube(0.0, "[0, 0, 1]"),
            tube(2.0, "[0, 1, 0]"),
            "axis to axis",
            Some(2.0),
            Some(std::f64::consts::FRAC_PI_2),
        ),
        (
            tube(0.0, "[1, 0, 0]"),
            tube(2.0, "[0, 0.6, 0.8]"),
            "axis to axis",
            Some(0.0),
            Some(std::f64::consts::FRAC_PI_2),
        ),
        // a pipe along a wall, and one into it
        (tube(0.0, "[1, 0, 0]"), plane(2.0, 0.0), "plane to axis", Some(3.0), Some(0.0)),
        (
            tube(0.0, "[0, 0, 1]"),
            plane(2.0, 0.0),
            "plane to axis",
            None,
            Some(std::f64::consts::FRAC_PI_2),
        ),
        (ball(3.0), tube(0.0, "[0, 0, 1]"), "axis to centre", Some(5.0), None),
        (ball(3.0), plane(2.0, 0.0), "plane to centre", Some(2.0), None),
        (ball(3.0), ball(-1.0), "centre to centre", Some(4.0), None),
    ] {
        let told = parts.of("surfaces", &format!("part.between({a}, {b})")).await;
        assert_eq!(told["what"], what);
        for (name, truth) in [("distance", distance), ("angle", angle)] {
            match truth {
                Some(truth) => {
                    assert!((told[name].as_f64().unwrap() - truth).abs() < 1e-9, "{what}: {told}")
                }
                None => assert!(told.get(name).is_none(), "{what}: {told}"),
            }
        }
    }
    assert_eq!(
        parts
            .of("surfaces", &format!("part.between({}, {{ type: 'elliptic_cone' }})", ball(0.0)))
            .await,
        Value::Null
    );
}

#[tokio::test(flavor = "multi_thread")]
async fn normals_are_the_gradients_of_the_surfaces() {
    let parts = Parts::start().await;
    // each with its own implicit function, whose gradient is taken by differences
    let c = "[10, 20, 30]";
    for (region, value) in [
        (format!("{{ type: 'sphere', surface: {{ center: {c} }} }}"), "Math.hypot(x, y, z)"),
        (
            format!(
                "{{ type: 'cylinder', surface: {{ axis_point: {c}, axis_direction: [0, 0, 1] }} }}"
            ),
            "Math.hypot(x, y)",
        ),
        (
            format!(
                "{{ type: 'cone', surface: {{ apex: {c}, axis_direction: [0, 0, 1], half_angle: 0.4 }} }}"
            ),
            "Math.hypot(x, y) - z * Math.tan(0.4)",
        ),
        (
            format!(
                "{{ type: 'torus', surface: {{ center: {c}, axis_direction: [0, 0, 1], major_radius: 3, minor_radius: 1 }} }}"
            ),
            "Math.hypot(Math.hypot(x, y) - 3, z)",
        ),
        (
            format!(
                "{{ type: 'ellipsoid', surface: {{ center: {c}, semi_axes: [3, 2, 1], semi_axis_directions: [[0, 1, 0], [1, 0, 0], [0, 0, 1]] }} }}"
            ),
            "x * x / 4 + y * y / 9 + z * z",
        ),
        (
            format!(
                "{{ type: 'elliptic_cylinder', surface: {{ axis_point: {c}, semi_axes: [3, 2], semi_axis_directions: [[0, 1, 0], [0, 0, 1]] }} }}"
            ),
            "y * y / 9 + z * z / 4",
        ),
    ] {
        // about a middle of (1, 1, 1), as clouds are
        let script = format!(
            "(() => {{ const f = ([x, y, z]) => {value}, p = [1.3, -2.1, 0.7]; \
            const normal = part.normalOf({region}, [1, 1, 1])(p.map((v, k) => v + {c}[k] - 1)); \
            const gradient = [0, 1, 2].map(k => {{ const at = s => p.map((v, j) => v + (j === k ? s : 0)); return f(at(1e-5)) - f(at(-1e-5)); }}); \
            const n = v => Math.hypot(...v); \
            return normal.map((v, k) => v / n(normal) - gradient[k] / n(gradient)); }})()"
        );
        let off = numbers(&parts.of("surfaces", &script).await);
        assert!(off.iter().all(|d| d.abs() < 1e-6), "{region}: {off:?}");
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn what_is_fitted_is_in_sight_and_what_is_picked_is_in_front() {
    let parts = Parts::start().await;
    // two plates of points, one above the other, seen from above
    let cloud = "(() => { const n = 20000, positions = new Float32Array(3 * n), labels = new Int32Array(n); \
        let state = 1; const random = () => (state = (state * 48271) % 2147483647) / 2147483647; \
        for (let k = 0; k < n; k++) { labels[k] = k % 2; \
        positions.set([10 * random() - 5, 10 * random() - 5, k % 2 ? 2 : -2], 3 * k); } \
        return { positions, labels, count: n, radius: 8, reach: 8, spacing: 0.1 }; })()";
    for flat in ["true", "false"] {
        let script = format!(
            "(() => {{ const cloud = {cloud}; \
            const camera = part.fitted(cloud, {{ ...part.camera(8), yaw: -Math.PI / 2, pitch: Math.PI / 2, flat: {flat} }}, 1.5, () => true); \
            const matrix = part.matrix(camera, 1.5, 8), size = 3 * cloud.spacing * part.scale({{ ...camera, distance: {flat} ? camera.distance : 1 }}, 600); \
            let out = 0, most = 0; \
            for (let k = 0; k < cloud.count; k++) {{ const p = part.project(matrix, [...cloud.positions.subarray(3 * k, 3 * k + 3)], 900, 600); \
              most = Math.max(most, Math.abs(p[1] / 300 - 1)); if (p[0] < 0 || p[0] > 900 || p[1] < 0 || p[1] > 600) out++; }} \
            const pick = shown => part.pick(cloud, camera, matrix, [500, 250], 900, 600, size, shown); \
            const both = pick(() => true), lower = pick(label => label === 0), none = part.pick(cloud, camera, matrix, [20, 20], 900, 600, size, () => true); \
            const place = k => part.project(matrix, [...cloud.positions.subarray(3 * k, 3 * k + 3)], 900, 600); \
            return [out, most, both % 2, lower % 2, none, Math.hypot(place(both)[0] - 500, place(both)[1] - 250)]; }})()"
        );
        let told = numbers(&parts.of("camera", &script).await);
        assert_eq!(told[0], 0.0, "{told:?}");
        // it fills the room there is
        assert!((0.77..0.82).contains(&told[1]), "{told:?}");
        assert_eq!((told[2], told[3], told[4]), (1.0, 0.0, -1.0));
        assert!(told[5] < 8.0, "{told:?}");
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn a_ply_file_is_read_far_from_the_origin_and_with_holes() {
    let parts = Parts::start().await;
    // three vertices, the second not finite, behind columns of their own
    let script = "(() => { const head = 'ply\\nformat binary_little_endian 1.0\\nelement vertex 3\\nproperty double x\\nproperty double y\\nproperty double z\\n\
        property uchar red\\nproperty uchar green\\nproperty uchar blue\\nproperty int label\\nproperty double deviation\\nproperty short own\\nend_header\\n'; \
        const bytes = new TextEncoder().encode(head), all = new Uint8Array(bytes.length + 3 * 41), data = new DataView(all.buffer, bytes.length); all.set(bytes); \
        [[4e6 + 0.25, 1, 2, 7, 0.5], [NaN, NaN, NaN, -1, NaN], [4e6 + 1.25, 3, 2, 9, -0.25]].forEach(([x, y, z, label, deviation], k) => { \
          [x, y, z].forEach((v, j) => data.setFloat64(41 * k + 8 * j, v, true)); data.setUint8(41 * k + 24, 10 * k); \
          data.setInt32(41 * k + 27, label, true); data.setFloat64(41 * k + 31, deviation, true); }); \
        const cloud = part.readPly(all.buffer); \
        return [cloud.count, [...cloud.labels].sort(), cloud.middle, [0, 1].map(cloud.exact).sort(), [...cloud.positions].map(Math.abs), [...cloud.deviations].sort()]; })()";
    let told = parts.of("cloud", script).await;
    let truth = json!([
        2,
        [7, 9],
        [4_000_000.75, 2, 2],
        [[4_000_000.25, 1, 2], [4_000_001.25, 3, 2]],
        [0.5, 1, 0, 0.5, 1, 0],
        [-0.25, 0.5]
    ]);
    assert_eq!(told.to_string().replace(".0", ""), truth.to_string().replace(".0", ""));
    // any first part of the order is spread over the whole, and each comes once
    let order = "[1, 2, 3, 10, 1000, 99991].map(n => { const order = part.spread(n); return new Set(order).size === n && Math.max(...order) === n - 1; })";
    assert_eq!(parts.of("cloud", order).await, json!([true, true, true, true, true, true]));
    let even = "(() => { const order = part.spread(10000).subarray(0, 100), bins = new Set([...order].map(v => Math.floor(v / 200))); return bins.size; })()";
    assert!(parts.of("cloud", even).await.as_f64().unwrap() >= 45.0);
}

#[tokio::test(flavor = "multi_thread")]
async fn regions_of_another_run_are_those_that_share_their_points() {
    let parts = Parts::start().await;
    let script = "(() => { const before = [0, 0, 0, 0, 1, 1, 1, 2, 2, -1], after = [2, 2, 2, 2, 0, 0, 0, 1, 0, 1]; \
        const match = part.matched(before, after); \
        const own = new Map([[0, 'a'], [1, 'b'], [2, 'c'], [-1, 'grey']]), old = new Map([[0, 'a'], [1, 'b'], [2, 'c'], [-1, 'grey']]); \
        return [[...match].sort(), [...part.palette(own, old, match)].sort()]; })()";
    let told = parts.of("palette", script).await;
    // region 1 has half of its points from 2, and keeps its colour
    assert_eq!(told[0], json!([[0, 1], [1, 2], [2, 0]]));
    assert_eq!(told[1], json!([[-1, "grey"], [0, "b"], [1, "c"], [2, "a"]]));
    // a region that was not there before gets a colour that is free
    let script = "[...part.palette(new Map([[0, 'a'], [1, 'b']]), new Map([[0, 'b']]), new Map([[1, 0]]))].sort().join()";
    assert_eq!(parts.of("palette", script).await, "-1,128,128,128,0,a,1,b");
    let script = "[...part.palette(new Map([[0, 'a'], [1, 'b']]), new Map([[0, 'a'], [1, 'b']]), new Map([[1, 0]]))].sort().join()";
    assert_eq!(parts.of("palette", script).await, "-1,128,128,128,0,b,1,a");
}

#[tokio::test(flavor = "multi_thread")]
async fn a_tally_counts_every_point_once_and_bars_are_round() {
    let parts = Parts::start().await;
    let script = "(() => { const told = part.tally({ labels: [0, 0, 0, 1, -1, 0], deviations: [-9, 0, 0.5, 3, 0, 9] }, label => label === 0, 1); \
        return [told.count, told.bars[0], told.bars[20], told.bars[40], told.mean]; })()";
    assert_eq!(numbers(&parts.of("histogram", script).await), [4.0, 1.0, 1.0, 1.0, 0.125]);
    let lengths = "[1, 1.99, 2, 4.9, 0.3, 0.07, 73, 1e-7].map(part.roundLength)";
    assert_eq!(
        numbers(&parts.of("overlay", lengths).await),
        [1.0, 1.0, 2.0, 2.0, 0.2, 0.05, 50.0, 1e-7]
    );
}
