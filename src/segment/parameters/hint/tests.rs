use super::*;

fn error(text: &str) -> String {
    read(text).unwrap_err().to_string()
}

#[test]
fn a_list_an_object_and_objects_with_commas_are_the_same() {
    let one = r#"{"at": [[1, 2, 3]], "type": "cylinder", "radius": 10}"#;
    let told = Hint {
        at: vec![[1.0, 2.0, 3.0]],
        surface_type: Some(SurfaceType::Cylinder),
        radius: Some(10.0),
        ..Hint::default()
    };
    assert_eq!(read(one), Ok(vec![told.clone()]));
    assert_eq!(read(EXAMPLE), Ok(vec![told.clone()]));
    assert_eq!(read(&format!("{one},{one}")), Ok(vec![told.clone(), told.clone()]));
    assert_eq!(read(" "), Ok(Vec::new()));
    let written = serde_json::to_string(&vec![told.clone()]).unwrap();
    assert_eq!(read(&written), Ok(vec![told]));
}

#[test]
fn what_cannot_be_is_refused_with_what_to_do() {
    for (text, word) in [
        ("{", "give a JSON list"),
        ("cylinder", "no JSON at column 2"),
        ("7", "expected a hint in braces"),
        (r#"{"at": [[0, 0, 0]], "radius": 1e300}"#, "'radius' 1e300 is not"),
        (r#"{"at": [[1, 2]], "type": "plane"}"#, "give a JSON list"),
        (r#"{"place": [1, 2, 3]}"#, "place"),
        (r#"{"type": "plane"}"#, "no place"),
        (r#"{"at": [[0, 0, 0]]}"#, "says nothing"),
        (r#"{"at": [[0, 0, 0]], "type": "blob"}"#, "blob"),
        (r#"{"at": [[0, 0, 0]], "type": "elliptic_cone"}"#, "cannot be told"),
        (r#"{"at": [[0, 0, 1e13]], "type": "plane"}"#, "coordinate"),
        (r#"{"at": [[0, 0, 0]], "type": "cone", "radius": 1}"#, "no 'radius'"),
        (r#"{"at": [[0, 0, 0]], "type": "sphere", "axis_direction": [0, 0, 1]}"#, "axis_direction"),
        (r#"{"at": [[0, 0, 0]], "radius": 0}"#, "above 0"),
        (r#"{"at": [[0, 0, 0]], "radius": 1, "radius_tolerance": -1}"#, "from 0"),
        (r#"{"at": [[0, 0, 0]], "type": "cylinder", "radius_tolerance": 1}"#, "without 'radius'"),
        (r#"{"at": [[0, 0, 0]], "axis_direction": [0, 0, 0]}"#, "no direction"),
        (
            r#"{"at": [[0, 0, 0]], "axis_direction": [0, 0, 1], "axis_tolerance": 1.6}"#,
            "axis_tolerance",
        ),
        (r#"{"action": "split", "at": [[0, 0, 0]]}"#, "two or more"),
        (r#"{"action": "split", "at": [[0, 0, 0], [1, 0, 0]], "type": "plane"}"#, "of its own"),
        (r#"{"action": "crop", "at": [[0, 0, 0]]}"#, "to crop takes"),
        (r#"{"action": "crop", "labels": [1], "radius": 2}"#, "nothing but a place"),
        (r#"{"action": "crop", "extent": {"min": [0, 0, 1], "max": [1, 1, 0]}}"#, "empty"),
    ] {
        let told = error(text);
        assert!(told.starts_with("parameter 'hints': ") && told.contains(word), "{text}: {told}");
    }
}

#[test]
fn as_many_hints_points_and_labels_are_taken_as_the_caps_say_and_no_more() {
    let hint = r#"{"labels": [1], "type": "plane"}"#;
    let hints = |n: usize| vec![hint; n].join(",");
    assert_eq!(read(&hints(MAX_HINTS)).unwrap().len(), MAX_HINTS);
    assert!(error(&hints(MAX_HINTS + 1)).contains("at most 64"));
    let places = |n: usize| {
        let at = vec!["[0, 0, 0]"; n].join(",");
        let labels = vec!["7"; n].join(",");
        [
            format!(r#"{{"at": [{at}], "type": "plane"}}"#),
            format!(r#"{{"labels": [{labels}], "type": "plane"}}"#),
        ]
    };
    for (fits, long) in places(MAX_PLACES).iter().zip(places(MAX_PLACES + 1)) {
        assert!(read(fits).is_ok());
        assert!(error(&long).contains("at most 64"));
    }
}
