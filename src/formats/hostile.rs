//! Small files of every format, cut and changed in thousands of ways: each must be answered, with a
//! cloud or an error, and none may make the reader panic.

use super::{Format, Limits, announced_points, e57, las, pcd, ply, ptx, read, stl};

/// A valid file of each kind.
pub(super) fn files() -> Vec<(Format, Vec<u8>)> {
    let ascii_ply = "ply\nformat ascii 1.0\nobj_info num_cols 1\nobj_info num_rows 2\n\
        element a 1\nproperty list uchar int l\nelement vertex 2\nproperty float x\n\
        property list int char m\nproperty float y\nproperty float z\nend_header\n\
        2 8 9\n1 0 2 3\n4 1 7 5 6\n";
    let ascii_pcd = "# .PCD v0.7\nVERSION 0.7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\n\
        COUNT 1 1 1\nWIDTH 2\nHEIGHT 1\nPOINTS 2\nDATA ascii\n1 2 3\nnan 5 6\n";
    vec![
        (Format::Ply, ascii_ply.into()),
        (Format::Ply, ply::tests::binary(false)),
        (Format::Ply, ply::tests::binary(true)),
        (Format::Xyz, "x;y;z;n\n1,5;2;-3e2;a\n\"4\";5;;b\n".into()),
        (Format::Xyz, "3\n1 2 3\n# c\n4\t5 6 7\n1e400 nan -inf".into()),
        (Format::Xyz, "\tx\ty\tz\n\t1\t2\t\"3\"\n#N/A\t4\t5\t6\n".into()),
        (Format::Xyz, "\u{feff}x y z\n1 2 3\n".encode_utf16().flat_map(u16::to_le_bytes).collect()),
        (Format::Ptx, ptx::tests::file().into()),
        (Format::Pcd, ascii_pcd.into()),
        (Format::Pcd, pcd::tests::binary_file()),
        (Format::Pcd, pcd::tests::compressed_file()),
        (Format::Las, las::tests::file(0, false, 4).0),
        (Format::Las, las::tests::file(0, true, 40).0),
        (Format::Las, las::tests::file(7, true, 40).0),
        (Format::E57, e57::tests::file()),
        (Format::Stl, stl::tests::binary_file()),
        (Format::Stl, stl::tests::ascii_file().into()),
        (Format::Obj, "# o\nv 1 2 3\nv 4 5 6 1 1 1\nf 1 2 1\n".into()),
        (Format::Off, "OFF # o\n3 1 0\n1 2 3\n4 5 6\n7 8 9 # c\n3 0 1 2\n".into()),
    ]
}

const LIMITS: Limits = Limits::of(100_000);

/// Reads with the format named and told from the bytes; only a panic can fail here.
fn answer(format: Format, bytes: &[u8]) {
    let _ = read(bytes, Some(format), &LIMITS);
    let _ = read(bytes, None, &LIMITS);
    let _ = announced_points(bytes, Some(format));
}

#[test]
fn whole_files_are_read() {
    for (format, bytes) in files() {
        assert!(read(&bytes, None, &LIMITS).is_ok(), "{format}");
        assert_eq!(Format::detect(&bytes), Some(format));
    }
}

#[test]
fn a_cut_at_any_byte_is_answered() {
    for (format, bytes) in files() {
        for end in 0..bytes.len() {
            answer(format, &bytes[..end]);
        }
    }
}

#[test]
fn any_file_under_any_name_is_answered() {
    for (_, bytes) in files() {
        for format in Format::ALL {
            answer(format, &bytes);
        }
    }
}

#[test]
fn changed_bytes_are_answered() {
    let mut state = 1u64;
    let mut below = |n: usize| {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
        (state >> 33) as usize % n
    };
    for (format, bytes) in files() {
        for _ in 0..1500 {
            let mut changed = bytes.clone();
            for _ in 0..=below(3) {
                let at = below(changed.len());
                match below(5) {
                    0 => changed[at] ^= 1 << below(8),
                    1 => changed[at] = [0, 255, 127, 128, b'9', b'-', b' ', b'\n'][below(8)],
                    2 => drop(changed.splice(at..at, [b'9'; 12])),
                    3 => drop(changed.remove(at)),
                    _ => {
                        let end = changed.len().min(at + 8);
                        changed[at..end].fill(255);
                    }
                }
            }
            answer(format, &changed);
        }
    }
}
