use super::*;
use crate::formats::Format;
use crate::formats::Limits;

fn parse(bytes: &[u8]) -> Result<PointCloud, FormatError> {
    read(bytes, &Meshes::default(), &Limits::default())
}

fn ascii(header: &str, body: &str) -> Vec<u8> {
    format!("ply\nformat ascii 1.0\n{header}end_header\n{body}").into_bytes()
}

const XYZ: &str = "property float x\nproperty float y\nproperty float z\n";

/// A binary file with a vertex of mixed types, behind another element and with a property between.
pub(in crate::formats) fn binary(big: bool) -> Vec<u8> {
    let order = if big { "big" } else { "little" };
    let mut file = format!(
        "ply\r\nformat binary_{order}_endian 1.0\r\ncomment end_header follows\r\n\
         element camera 2\r\nproperty list uchar short view\r\nproperty double f\r\n\
         element vertex 2\r\nproperty uchar red\r\nproperty double x\r\nproperty float y\r\n\
         property int label\r\nproperty short z\r\n\
         element face 1\r\nproperty list uchar int vertex_indices\r\nend_header\r\n"
    )
    .into_bytes();
    let mut put = |little: &[u8]| {
        let mut bytes = little.to_vec();
        if big {
            bytes.reverse();
        }
        file.extend(bytes);
    };
    for items in [vec![], vec![7i16, 8, 9]] {
        put(&[items.len() as u8]);
        items.iter().for_each(|i| put(&i.to_le_bytes()));
        put(&0.5f64.to_le_bytes());
    }
    for (x, y, z) in [(1.25f64, -2.5f32, 3i16), (1e-300, 5.0, -6)] {
        put(&[200]);
        put(&x.to_le_bytes());
        put(&y.to_le_bytes());
        put(&77i32.to_le_bytes());
        put(&z.to_le_bytes());
    }
    file
}

#[test]
fn binary_of_both_byte_orders_is_read_among_other_elements_and_properties() {
    for big in [false, true] {
        let cloud = parse(&binary(big)).unwrap();
        let points: Vec<[f64; 3]> = cloud.points.iter().map(|&p| p.into()).collect();
        assert_eq!(points, [[1.25, -2.5, 3.0], [1e-300, 5.0, -6.0]]);
    }
}

#[test]
fn every_cut_of_a_binary_file_is_an_error() {
    let whole = binary(false);
    for end in 0..whole.len() {
        assert!(parse(&whole[..end]).is_err(), "cut at {end}");
    }
}

#[test]
fn lists_in_the_vertices_are_passed_over() {
    let header = "element vertex 2\nproperty list uchar int n\nproperty float x\n\
                  property list int float m\nproperty float y\nproperty float z\n";
    let text = ascii(header, "2 8 9 1 0 2 3\n\n0 4 1 0.5\n5 6\n");
    let expected = vec![[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]];
    let points =
        |cloud: PointCloud| -> Vec<[f64; 3]> { cloud.points.iter().map(|&p| p.into()).collect() };
    assert_eq!(points(parse(&text).unwrap()), expected);

    let mut bytes =
        format!("ply\nformat binary_little_endian 1.0\n{header}end_header\n").into_bytes();
    let float = |values: &[f32]| values.iter().flat_map(|v| v.to_le_bytes()).collect::<Vec<_>>();
    bytes.extend([2, 8, 0, 0, 0, 9, 0, 0, 0]);
    bytes.extend(float(&[1.0]));
    bytes.extend([0; 4]);
    bytes.extend(float(&[2.0, 3.0]));
    bytes.extend([0]);
    bytes.extend(float(&[4.0]));
    bytes.extend([1, 0, 0, 0]);
    bytes.extend(float(&[0.5, 5.0, 6.0]));
    assert_eq!(points(parse(&bytes).unwrap()), expected);
}

#[test]
fn a_grid_keeps_its_order_and_its_holes() {
    let header = format!("obj_info num_cols 2\nobj_info num_rows 2\nelement vertex 4\n{XYZ}");
    let cloud = parse(&ascii(&header, "1 1 1\nnan nan nan\n3 3 3\n4 4 4\n")).unwrap();
    assert_eq!(cloud.grid, Some(crate::geometry::Grid { width: 2, height: 2 }));
    assert_eq!(cloud.labels_in_input_order(vec![0, 1, 2]), [0, -1, 1, 2]);
}

#[test]
fn a_count_beyond_the_bytes_is_refused_before_it_is_believed() {
    let lying = format!("element vertex 1000000000000\n{XYZ}");
    let announced = 1_000_000_000_000;
    assert_eq!(
        parse(&ascii(&lying, "1 2 3\n")),
        Err(FormatError::Truncated { format: Format::Ply, announced, found: 1 })
    );
    let mut bytes = format!("ply\nformat binary_big_endian 1.0\n{lying}end_header\n").into_bytes();
    bytes.extend([0; 24]);
    assert_eq!(
        parse(&bytes),
        Err(FormatError::Truncated { format: Format::Ply, announced, found: 2 })
    );
}

#[test]
fn an_empty_element_of_any_count_takes_no_time() {
    let header = format!("element nothing 18446744073709551615\nelement vertex 1\n{XYZ}");
    assert_eq!(parse(&ascii(&header, "1 2 3")).unwrap().points.len(), 1);
    let header = header.replace("vertex 1", "vertex 2");
    assert!(parse(&ascii(&header, "1 2 3")).is_err());
}

#[test]
fn the_limit_holds_at_the_cap_and_one_above() {
    let text = |n: usize| ascii(&format!("element vertex {n}\n{XYZ}"), &"1 2 3\n".repeat(n));
    let limits = Limits::of(3);
    assert!(read(&text(3), &Meshes::default(), &limits).is_ok());
    assert_eq!(
        read(&text(4), &Meshes::default(), &limits),
        Err(FormatError::TooManyPoints { points: 4, limit: 3 })
    );
}

#[test]
fn header_errors_say_what_is_wrong() {
    let reason = |text: &str| match parse(text.as_bytes()) {
        Err(FormatError::Header { line, reason, .. }) => (line, reason),
        other => panic!("{other:?}"),
    };
    assert_eq!(reason("plx\n").0, 1);
    assert_eq!(reason("ply\nformat ascii 1.0\n"), (2, "end_header is missing".into()));
    assert_eq!(reason("ply\nformat text 1.0\n").0, 2);
    assert_eq!(reason("ply\nformat ascii 1.0\nelement vertex -3\n").0, 3);
    assert_eq!(reason("ply\nelement vertex 1\nproperty real x\n"), (3, "unknown type real".into()));
    let no_z = "element vertex 1\nproperty float x\nproperty float y\n";
    assert_eq!(
        parse(&ascii(no_z, "1 2\n")),
        Err(FormatError::NoCoordinates { format: Format::Ply, found: "vertex.x, vertex.y".into() })
    );
    let bad = ascii(&format!("element vertex 2\n{XYZ}"), "1 2 3\n4 five 6\n");
    assert_eq!(
        parse(&bad),
        Err(FormatError::BadNumber { format: Format::Ply, line: 9, text: "five".into() })
    );
}

/// A CAD mesh of a cylinder, its faces before or behind its vertices.
fn cad(format: &str, faces_first: bool) -> Vec<u8> {
    let (points, faces) = crate::formats::mesh::tests::turned(64, 15.0, 40.0, 15.0);
    let mut elements = [
        format!("element vertex {}\n{XYZ}", points.len()),
        format!("element face {}\nproperty list uchar int vertex_indices\n", faces.len()),
    ];
    let mut bodies = [vec![], vec![]];
    let ascii = format == "ascii";
    for p in points {
        let text = format!("{} {} {}\n", p.x, p.y, p.z).into_bytes();
        let bytes = p.iter().flat_map(|&x| (x as f32).to_be_bytes()).collect();
        bodies[0].extend::<Vec<u8>>(if ascii { text } else { bytes });
    }
    for f in faces {
        let text = format!("3 {} {} {}\n", f[0], f[1], f[2]).into_bytes();
        let bytes = std::iter::once(3).chain(f.iter().flat_map(|i| i.to_be_bytes())).collect();
        bodies[1].extend::<Vec<u8>>(if ascii { text } else { bytes });
    }
    if faces_first {
        elements.reverse();
        bodies.reverse();
    }
    let header = format!("ply\nformat {format} 1.0\n{}end_header\n", elements.concat());
    [header.into_bytes(), bodies.concat()].concat()
}

#[test]
fn the_faces_of_a_cad_mesh_are_sampled() {
    for format in ["ascii", "binary_big_endian"] {
        for faces_first in [false, true] {
            let file = cad(format, faces_first);
            let mesh = parse(&file).unwrap().mesh.unwrap();
            assert_eq!((mesh.vertices, mesh.faces), (130, 256), "{format}");
            assert!(mesh.samples.is_some(), "{format}");
            // the same vertices without faces are points
            let text = String::from_utf8_lossy(&file).into_owned();
            if format == "ascii" && !faces_first {
                let cloud = parse(text.replace("element face", "element other").as_bytes());
                assert_eq!(cloud.unwrap().points.len(), 130);
            }
        }
    }
}

#[test]
fn faces_that_cannot_be_read_are_no_error() {
    for face in ["3 0 1", "x", "3 0 1 99", "-1 0"] {
        let header = format!(
            "element vertex 2\n{XYZ}element face 9\nproperty list uchar int vertex_index\n"
        );
        let cloud = parse(&ascii(&header, &format!("1 2 3\n4 5 6\n{face}\n")));
        assert_eq!(cloud.unwrap().points.len(), 2, "{face}");
    }
}
