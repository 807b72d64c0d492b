//! How much memory there is, and whether a cloud has room in it.

use std::{fs, path::Path};

use crate::formats::{self, BYTES_PER_THINNED, Hints};

/// Bytes that a point takes where all are used: its place, what the method keeps of it (docs/speed.md), its label.
const BYTES_PER_POINT: u64 = formats::BYTES_PER_POINT + 60 + 4;
/// Bytes that a point takes which thinning keeps, with those that came up beside it, and those of the method.
const BYTES_PER_KEPT: u64 = 1000;
/// What the program itself takes, and what is worked on at a time.
const BESIDE: u64 = 32 << 20;

/// A cloud that has no room.
#[derive(Debug, thiserror::Error)]
pub enum NoRoom {
    /// With all its points.
    #[error(
        "the cloud has up to {points} points and takes about {needed} MB of memory, of which {free} MB are free: \
         give thin=LENGTH, in the file's unit (--thin {}), which uses points no closer to each other and labels all", or_length(*.thin)
    )]
    All {
        /// Points announced.
        points: u64,
        /// Megabytes that they take.
        needed: u64,
        /// Megabytes that are free.
        free: u64,
        /// A length that would do, where one is known.
        thin: Option<f64>,
    },
    /// Although it is thinned.
    #[error(
        "the cloud has up to {points} points and takes about {needed} MB of memory also where it is thinned, of which {free} \
         MB are free{}", why_held(*.held)
    )]
    Thinned {
        /// Points announced.
        points: u64,
        /// Megabytes that they take at least.
        needed: u64,
        /// Megabytes that are free.
        free: u64,
        /// Whether the file's format is read whole.
        held: bool,
    },
}

fn or_length(thin: Option<f64>) -> String {
    thin.map_or("LENGTH".to_owned(), |length| format!("{length} would do"))
}

fn why_held(held: bool) -> &'static str {
    if held {
        ": a file of this form is read whole before it is thinned; PLY, PCD, LAS, E57 and text are not"
    } else {
        ": split the file, or take a machine with more memory"
    }
}

/// Bytes that thinning may take for a cloud; an error where there is no room for it at all.
///
/// # Errors
/// It would take more memory than is `free`.
pub fn check(bytes: &[u8], hints: Hints, most_points: u64, free: u64) -> Result<u64, NoRoom> {
    // a text may have lines that are no points
    let points = formats::announced_points(bytes, hints).min(most_points);
    let held = !formats::is_handed_on(bytes, hints);
    let beside = BESIDE + formats::bytes_beside(bytes, hints);
    if hints.thin.is_none() {
        let needed = beside + points.saturating_mul(BYTES_PER_POINT);
        if needed <= free {
            return Ok(u64::MAX);
        }
        let room = free.saturating_sub(beside + points.saturating_mul(BYTES_PER_THINNED));
        let thin =
            (!held).then(|| formats::thin_for(bytes, hints, room / BYTES_PER_KEPT)).flatten();
        let (needed, free) = (needed >> 20, free >> 20);
        return Err(NoRoom::All { points, needed, free, thin });
    }
    let per_point = BYTES_PER_THINNED + if held { formats::BYTES_PER_POINT } else { 0 };
    let needed = beside + points.saturating_mul(per_point);
    let (more, free_mb) = (free.checked_sub(needed), free >> 20);
    more.ok_or(NoRoom::Thinned { points, needed: needed >> 20, free: free_mb, held })
}

/// Bytes of memory that this process may still take; more than any machine has where the system does not say.
pub fn free() -> u64 {
    [of_machine(), of_group(), of_process()].into_iter().flatten().min().unwrap_or(u64::MAX)
}

/// What the machine has left, without what it would have to write away.
fn of_machine() -> Option<u64> {
    let text = fs::read_to_string("/proc/meminfo").ok()?;
    Some(number_behind(&text, "MemAvailable:")? << 10)
}

/// What the control groups that the process is in, and those above them, leave it; copies of files do not count.
fn of_group() -> Option<u64> {
    of_groups(&fs::read_to_string("/proc/self/cgroup").ok()?, Path::new("/sys/fs/cgroup"))
}

/// What the groups leave that `groups` names, a line each as in /proc/self/cgroup, below `root`.
fn of_groups(groups: &str, root: &Path) -> Option<u64> {
    let groups = groups.lines().filter_map(|line| {
        let (controllers, path) = line.split_once(':')?.1.split_once(':')?;
        match controllers {
            "" => Some((root.to_owned(), path, &SECOND)),
            _ if controllers.split(',').any(|c| c == "memory") => {
                Some((root.join("memory"), path, &FIRST))
            }
            _ => None,
        }
    });
    let mut least = None;
    for (mount, path, names) in groups {
        // within a container the path may be that outside
        for path in Path::new(path).ancestors().chain([Path::new("/")]) {
            let place = mount.join(path.strip_prefix("/").unwrap_or(path));
            least = least.into_iter().chain(of_one_group(&place, names)).min();
        }
    }
    least
}

/// What a version of control groups calls what is read of it.
struct Names {
    most: &'static str,
    taken: &'static str,
    /// Copies of files, which count as taken, with those of the groups below.
    files: [&'static str; 2],
}

const FIRST: Names = Names {
    most: "memory.limit_in_bytes",
    taken: "memory.usage_in_bytes",
    files: ["total_inactive_file ", "total_active_file "],
};
const SECOND: Names = Names {
    most: "memory.max",
    taken: "memory.current",
    files: ["inactive_file ", "active_file "],
};

fn of_one_group(place: &Path, names: &Names) -> Option<u64> {
    let read = |name: &str| fs::read_to_string(place.join(name)).ok();
    // 'max' is no number; where there is no limit the first version has one that no machine reaches
    let most: u64 = read(names.most)?.trim().parse().ok()?;
    let taken: u64 = read(names.taken)?.trim().parse().ok()?;
    let files = read("memory.stat")
        .map(|stat| names.files.iter().filter_map(|name| number_behind(&stat, name)).sum());
    Some(most.saturating_sub(taken.saturating_sub(files.unwrap_or(0))))
}

/// What a limit on the process's own address space leaves it.
fn of_process() -> Option<u64> {
    let limits = fs::read_to_string("/proc/self/limits").ok()?;
    let most = number_behind(&limits, "Max address space")?;
    let status = fs::read_to_string("/proc/self/status").ok()?;
    Some(most.saturating_sub(number_behind(&status, "VmSize:")? << 10))
}

/// The number behind a name at the beginning of a line.
fn number_behind(text: &str, name: &str) -> Option<u64> {
    let line = text.lines().find_map(|line| line.strip_prefix(name))?;
    line.split_whitespace().next()?.parse().ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A binary file that announces a grid of points a unit apart.
    fn grid(side: u32) -> Vec<u8> {
        let n = side * side;
        let mut bytes = format!(
            "ply\nformat binary_little_endian 1.0\nelement vertex {n}\nproperty float x\nproperty float y\n\
             property float z\nend_header\n"
        )
        .into_bytes();
        for k in 0..n {
            for x in [k % side, k / side, 0] {
                bytes.extend((x as f32).to_le_bytes());
            }
        }
        bytes
    }

    #[test]
    fn what_has_no_room_is_told_with_a_length_that_has() {
        let bytes = grid(300);
        let hints = Hints::default();
        let needed = BESIDE + 90_000 * BYTES_PER_POINT;
        assert_eq!(check(&bytes, hints, 1 << 32, needed).unwrap(), u64::MAX);
        let told = check(&bytes, hints, 1 << 32, needed - 1).unwrap_err();
        let NoRoom::All { points: 90_000, thin: Some(thin), .. } = told else { panic!("{told}") };
        let most = (needed - 1 - BESIDE - 90_000 * BYTES_PER_THINNED) / BYTES_PER_KEPT;
        let hints = Hints { thin: Some(thin), ..hints };
        let kept = formats::read(&bytes, hints, &formats::Limits::default()).unwrap().points.len();
        assert!((most / 4..=most).contains(&(kept as u64)), "{kept} of {most}");
        let text = told.to_string();
        assert!(text.contains(&format!("--thin {thin} would do")), "{text}");
        // fewer points are asked for than are announced
        assert!(check(&bytes, Hints::default(), 80_000, needed - 1).is_ok());
    }

    #[test]
    fn a_thinned_cloud_needs_eight_bytes_a_point_and_leaves_the_rest() {
        let bytes = grid(100);
        let hints = Hints { thin: Some(3.0), ..Hints::default() };
        let needed = BESIDE + 10_000 * BYTES_PER_THINNED;
        assert_eq!(check(&bytes, hints, 1 << 32, needed + 7).unwrap(), 7);
        assert!(check(&bytes, hints, 1 << 32, needed - 1).is_err());
        let text = b"OFF\n3 0 0\n0 0 0\n1 0 0\n0 1 0\n";
        let told = check(text, hints, 1 << 32, 0).unwrap_err().to_string();
        assert!(told.contains("read whole before it is thinned"), "{told}");
    }

    #[test]
    fn the_least_of_the_groups_above_is_left_in_either_version() {
        let directory = tempfile::tempdir().unwrap();
        let root = directory.path();
        let group = |place: &str, files: [(&str, &str); 3]| {
            fs::create_dir_all(root.join(place)).unwrap();
            for (name, text) in files {
                fs::write(root.join(place).join(name), text).unwrap();
            }
        };
        let first = |most, taken, files| {
            [
                ("memory.limit_in_bytes", most),
                ("memory.usage_in_bytes", taken),
                ("memory.stat", files),
            ]
        };
        let second = |most, taken, files| {
            [("memory.max", most), ("memory.current", taken), ("memory.stat", files)]
        };
        let stat = "cache 900\ninactive_file 1\nactive_file 1\ntotal_inactive_file 70\ntotal_active_file 30\n";
        group("memory", first("9223372036854771712\n", "5000\n", stat));
        group("memory/a", first("1000\n", "400\n", stat));
        group("memory/a/b", first("9223372036854771712\n", "300\n", stat));
        let lines = "12:cpu,cpuacct:/\n4:memory:/a/b\n1:name=systemd:/a\n";
        assert_eq!(of_groups(lines, root), Some(1000 - (400 - 100)));
        // as a container sees it that does not see its path
        assert_eq!(of_groups("4:memory:/docker/x\n", root), Some(9_223_372_036_854_771_712 - 4900));
        assert_eq!(of_groups("12:cpu:/a\n", root), None);
        group("u", second("max\n", "10\n", ""));
        group("u/v", second("2000\n", "700\n", "inactive_file 50\nactive_file 150\n"));
        assert_eq!(of_groups("0::/u/v\n", root), Some(2000 - (700 - 200)));
        assert_eq!(of_groups("0::/u\n", root), None);
        assert_eq!(of_groups(&format!("{lines}0::/u/v\n"), root), Some(700));
    }

    #[test]
    fn numbers_stand_behind_their_names() {
        let text = "MemTotal:  12 kB\nMemAvailable:    34 kB\nMax address space   unlimited   unlimited  bytes\n";
        assert_eq!(number_behind(text, "MemAvailable:"), Some(34));
        assert_eq!(number_behind(text, "Max address space"), None);
        #[cfg(target_os = "linux")]
        assert!(free() > 1 << 20 && free() < u64::MAX);
    }
}
