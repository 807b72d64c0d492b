use super::*;
use crate::formats::Limits;
use crate::geometry::{Grid, Vec3};

const HEADER: &str = "# .PCD v0.7 - Point Cloud Data file format\nVERSION 0.7\n\
    FIELDS _ x intensity y z\nSIZE 1 4 2 8 4\nTYPE U F U F I\nCOUNT 3 1 1 1 1\n\
    WIDTH 2\nHEIGHT 2\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS 4\nDATA ";

const X: [f32; 4] = [1.5, f32::NAN, 3.5, -4.5];

fn parse(bytes: &[u8]) -> Result<PointCloud, FormatError> {
    read(bytes, &Limits::default())
}

fn expect_the_grid(cloud: &PointCloud) {
    let points: Vec<[f64; 3]> = cloud.points.iter().map(|&p| p.into()).collect();
    assert_eq!(points, [[1.5, 0.25, 10.0], [3.5, 2.25, 12.0], [-4.5, 3.25, 13.0]]);
    assert_eq!(cloud.input_index, Some(vec![0, 2, 3]));
    assert_eq!(cloud.grid, Some(Grid { width: 2, height: 2 }));
}

fn fields() -> [Vec<Vec<u8>>; 5] {
    let each = |f: &dyn Fn(usize) -> Vec<u8>| (0..4).map(f).collect();
    [
        each(&|_| vec![9; 3]),
        each(&|i| X[i].to_le_bytes().into()),
        each(&|i| (i as u16).to_le_bytes().into()),
        each(&|i| (0.25 + i as f64).to_le_bytes().into()),
        each(&|i| (10 + i as i32).to_le_bytes().into()),
    ]
}

pub(in crate::formats) fn binary_file() -> Vec<u8> {
    let mut file = format!("{HEADER}binary\n").into_bytes();
    let fields = fields();
    (0..4).for_each(|i| fields.iter().for_each(|f| file.extend(&f[i])));
    file
}

/// The body as literal runs, which any LZF reader must accept.
pub(in crate::formats) fn compressed_file() -> Vec<u8> {
    let plain: Vec<u8> = fields().concat().concat();
    let packed: Vec<u8> =
        plain.chunks(32).flat_map(|run| [&[run.len() as u8 - 1], run].concat()).collect();
    let mut file = format!("{HEADER}binary_compressed\n").into_bytes();
    file.extend((packed.len() as u32).to_le_bytes());
    file.extend((plain.len() as u32).to_le_bytes());
    file.extend(packed);
    file
}

#[test]
fn all_three_encodings_give_the_same_organised_cloud() {
    let rows =
        "9 9 9 1.5 0 0.25 10\n9 9 9 nan 1 1.25 11\n9 9 9 3.5 2 2.25 12\n9 9 9 -4.5 3 3.25 13";
    expect_the_grid(&parse(format!("{HEADER}ascii\n{rows}\n").as_bytes()).unwrap());
    expect_the_grid(&parse(&binary_file()).unwrap());
    expect_the_grid(&parse(&compressed_file()).unwrap());
}

#[test]
fn every_cut_of_a_binary_body_is_an_error() {
    for file in [binary_file(), compressed_file()] {
        for end in 0..file.len() {
            assert!(parse(&file[..end]).is_err(), "cut at {end}");
        }
    }
}

#[test]
fn a_count_beyond_the_bytes_is_refused_before_it_is_believed() {
    let announced = 1_000_000_000_000;
    let header = HEADER.replace("POINTS 4", &format!("POINTS {announced}"));
    let header = header.replace("WIDTH 2\nHEIGHT 2", &format!("WIDTH {announced}\nHEIGHT 1"));
    for (data, found) in [("ascii\n1 1 1 1 1 1 1", 1), ("binary\n0123456789012345678901", 1)] {
        assert_eq!(
            parse(format!("{header}{data}").as_bytes()),
            Err(FormatError::Truncated { format: Format::Pcd, announced, found })
        );
    }
    let mut bomb = format!("{header}binary_compressed\n").into_bytes();
    bomb.extend([4, 0, 0, 0, 255, 255, 255, 255, 0, 0, 0, 0]);
    assert!(matches!(parse(&bomb), Err(FormatError::Damaged { .. })));
}

#[test]
fn the_limit_holds_at_the_cap_and_one_above() {
    let file = binary_file();
    assert!(read(&file, &Limits::of(4)).is_ok());
    assert_eq!(
        read(&file, &Limits::of(3)),
        Err(FormatError::TooManyPoints { points: 4, limit: 3 })
    );
}

#[test]
fn headers_without_coordinates_or_with_odd_entries_are_refused() {
    let header = HEADER.replace("intensity y", "y intensity_y").replace(" z\n", " w\n");
    assert!(matches!(
        parse(format!("{header}binary\n").as_bytes()),
        Err(FormatError::Truncated { .. } | FormatError::NoCoordinates { .. })
    ));
    for (from, to, at) in [
        ("SIZE 1", "SIZE 3", 5),
        ("SIZE 1", "SIZE", 4),
        ("TYPE U F", "TYPE U", 5),
        ("TYPE U F U F I\n", "", 10),
        ("COUNT 3", "COUNT 0", 6),
        ("COUNT 3", "COUNT x", 6),
        ("COUNT 3", "COUNT", 6),
        ("WIDTH 2", "WIDTH two", 7),
        ("POINTS 4", "POINTS 3", 10),
        ("POINTS 4", "POINTS 5", 10),
    ] {
        let text = format!("{}binary\n", HEADER.replace(from, to));
        match parse(text.as_bytes()) {
            Err(FormatError::Header { line, .. }) => assert_eq!(line, at, "{to}"),
            other => panic!("{to}: {other:?}"),
        }
    }
}

/// A block that unpacks to 4 + 264 n bytes, all 0.
fn zeros_of(n: usize) -> Vec<u8> {
    let mut block = vec![3, 0, 0, 0, 0];
    block.extend([0b111_00000, 255, 0].repeat(n));
    block
}

/// A compressed cloud of `points` at the origin with `pad` bytes more a point.
fn bomb(points: usize, pad: usize) -> Vec<u8> {
    let steps = points * (12 + pad) / 264 + 1;
    let (block, unpacked) = (zeros_of(steps), 4 + 264 * steps);
    let mut file = format!(
        "FIELDS pad x y z\nSIZE 1 4 4 4\nTYPE U F F F\nCOUNT {pad} 1 1 1\nWIDTH {points}\nHEIGHT 1\n\
         POINTS {points}\nDATA binary_compressed\n"
    )
    .into_bytes();
    file.extend((block.len() as u32).to_le_bytes());
    file.extend((unpacked as u32).to_le_bytes());
    file.extend(block);
    file
}

#[test]
fn what_is_no_coordinate_is_passed_over_as_it_unpacks() {
    // 100 MB of them: they are unpacked a page at a time
    let points = 100;
    let cloud = parse(&bomb(points, 1_000_000)).unwrap();
    assert!(cloud.points.len() == points && cloud.points.iter().all(|p| p.norm() == 0.0));
}

#[test]
fn unpacking_stops_when_the_cloud_is_not_wanted_any_more() {
    use std::sync::atomic::{AtomicUsize, Ordering};
    let looks = AtomicUsize::new(0);
    let stopped = || looks.fetch_add(1, Ordering::Relaxed) >= 5;
    let watched = crate::formats::Watched { limits: Limits::default(), stopped: &stopped };
    assert_eq!(read(&bomb(100, 1_000_000), &watched), Err(FormatError::Stopped));
    assert_eq!(looks.into_inner(), 6);
}

#[test]
fn columns_that_end_between_two_steps_are_put_together() {
    let points = 20_000;
    let mut plain = Vec::new();
    // an odd column before the others
    plain.extend(vec![7u8; points]);
    for axis in 0..3 {
        (0..points).for_each(|i| plain.extend((i as f32 + axis as f32 * 0.25).to_le_bytes()));
    }
    let block: Vec<u8> =
        plain.chunks(32).flat_map(|run| [&[run.len() as u8 - 1], run].concat()).collect();
    let mut file = format!(
        "FIELDS pad x y z\nSIZE 1 4 4 4\nTYPE U F F F\nWIDTH {points}\nHEIGHT 1\n\
         DATA binary_compressed\n"
    )
    .into_bytes();
    file.extend((block.len() as u32).to_le_bytes());
    file.extend((plain.len() as u32).to_le_bytes());
    file.extend(block);
    let cloud = parse(&file).unwrap();
    for (i, p) in cloud.points.iter().enumerate() {
        let x = i as f64;
        assert_eq!(*p, Vec3::new(x, x + 0.25, x + 0.5));
    }
    assert_eq!(cloud.points.len(), points);
}

#[test]
fn the_first_files_had_their_points_in_one_row() {
    let head = "# .PCD v.5 - Point Cloud Data file format\nVERSION .5\nCOLUMNS x y z\nSIZE 4 4 4\nTYPE F F F\n";
    let text = format!("{head}POINTS 2\nDATA ascii\n1 2 3\n4 5 6\n");
    let cloud = read(text.as_bytes(), &Limits::default()).unwrap();
    assert_eq!((cloud.points.len(), cloud.grid), (2, None));
    assert_eq!(cloud.points[1], Vec3::new(4.0, 5.0, 6.0));
    for wrong in ["", "HEIGHT 2\nPOINTS 2\n"] {
        let text = format!("{head}{wrong}DATA ascii\n1 2 3\n4 5 6\n");
        let told = read(text.as_bytes(), &Limits::default()).unwrap_err().to_string();
        assert!(told.contains("no WIDTH line"), "{told}");
    }
}
