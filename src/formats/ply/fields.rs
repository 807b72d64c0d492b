//! A file's own columns, kept beside what is found.

use super::super::{
    Format,
    scalar::{Endian, Scalar},
    text::Words,
};
use super::ascii;
use super::header::{Encoding, Header, Kind, parse_scalar};

/// The columns of a PLY file's vertices beside x, y and z: normals, colours, intensity and whatever it has.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Fields {
    /// Name and PLY type of each.
    pub columns: Vec<(String, &'static str)>,
    /// Bytes of one vertex.
    pub stride: usize,
    /// The vertices in input order, little-endian.
    pub records: Vec<u8>,
}

impl Fields {
    /// Those of a PLY file; none of anything else, and none where a vertex holds lists.
    pub fn of(bytes: &[u8]) -> Self {
        Self::read(bytes, None).unwrap_or_default()
    }

    /// Those of some vertices: the places of these in ascending order, or `None` for all.
    pub fn of_some(bytes: &[u8], places: Option<&[u32]>) -> Self {
        Self::read(bytes, places).unwrap_or_default()
    }

    /// Whether those of any vertices can be found without a look at the others.
    pub fn are_in_place(bytes: &[u8]) -> bool {
        Header::parse(bytes).is_ok_and(|header| matches!(header.encoding, Encoding::Binary(_)))
    }

    /// Whether a PLY file's header names labels or normals: only then are its columns worth reading for them.
    pub fn are_told(bytes: &[u8]) -> bool {
        let names = |header: &Header| {
            let vertex = header.vertex().ok()?;
            let properties = &header.elements[vertex.element].properties;
            Some(properties.iter().any(|p| [&b"label"[..], b"nx"].contains(&p.name)))
        };
        Header::parse(bytes).ok().and_then(|header| names(&header)).unwrap_or(false)
    }

    fn read(bytes: &[u8], places: Option<&[u32]>) -> Option<Self> {
        let header = Header::parse(bytes).ok()?;
        let vertex = header.vertex().ok()?;
        let element = &header.elements[vertex.element];
        let (mut scalars, mut columns) = (Vec::new(), Vec::new());
        for (place, property) in element.properties.iter().enumerate() {
            let Kind::Scalar(scalar) = property.kind else { return None };
            let kept = !vertex.coordinates.contains(&place);
            scalars.push((scalar, kept));
            if kept {
                columns
                    .push((std::str::from_utf8(property.name).ok()?.to_owned(), scalar.ply_name()));
            }
        }
        let count = usize::try_from(element.count).ok()?;
        let stride = scalars.iter().filter(|s| s.1).map(|s| s.0.size()).sum();
        let mut fields = Self { columns, stride, records: Vec::new() };
        if stride == 0 {
            return Some(fields);
        }
        let before = &header.elements[..vertex.element];
        match header.encoding {
            Encoding::Binary(endian) => {
                let skipped =
                    before.iter().map(|e| Some(e.stride()? * usize::try_from(e.count).ok()?));
                let from = header.body + skipped.sum::<Option<usize>>()?;
                let whole: usize = scalars.iter().map(|s| s.0.size()).sum();
                let records = bytes.get(from..from.checked_add(count.checked_mul(whole)?)?)?;
                let record = |k: usize| records.get(k * whole..(k + 1) * whole);
                fields.records.reserve_exact(places.map_or(count, <[u32]>::len) * stride);
                match places {
                    None => records.chunks(whole).for_each(|r| fields.push(r, &scalars, endian)),
                    Some(places) => places.iter().try_for_each(|&k| {
                        fields.push(record(k as usize)?, &scalars, endian);
                        Some(())
                    })?,
                }
            }
            Encoding::Ascii => {
                let mut words = Words::new(Format::Ply, bytes, header.body);
                for other in before {
                    ascii::skip(&mut words, other).ok()??;
                }
                let mut places = places.map(|places| places.iter().peekable());
                for k in 0..count {
                    let next =
                        places.as_mut().map(|places| places.next_if(|&&at| at as usize == k));
                    let is_wanted = next.is_none_or(|next| next.is_some());
                    for (scalar, kept) in &scalars {
                        let word = words.next()?;
                        if *kept && is_wanted {
                            scalar.write(words.number(word).ok()?, &mut fields.records);
                        }
                    }
                }
            }
        }
        Some(fields)
    }

    /// The column `label` of whole numbers, as results have it; none where there is no such column.
    pub fn labels(&self) -> Option<Vec<i32>> {
        let (at, scalar) = self.column("label")?;
        if matches!(scalar.ply_name(), "float" | "double") {
            return None;
        }
        // an unsigned number beyond the range is no label of a result
        Some(self.values(at, scalar).map(|v| v as i32).collect())
    }

    /// The columns nx, ny and nz; none where one is missing.
    pub fn normals(&self) -> Option<Vec<[f32; 3]>> {
        let [x, y, z] = ["nx", "ny", "nz"].map(|name| self.column(name));
        let values = |(at, scalar)| self.values(at, scalar).map(|v| v as f32);
        let (x, y, z) = (values(x?), values(y?), values(z?));
        Some(x.zip(y).zip(z).map(|((x, y), z)| [x, y, z]).collect())
    }

    /// Where a column stands in a record, and its type.
    fn column(&self, name: &str) -> Option<(usize, Scalar)> {
        let place = self.columns.iter().position(|c| c.0 == name)?;
        let scalar = |k: usize| parse_scalar(self.columns[k].1.as_bytes());
        let before = (0..place).map(|k| Some(scalar(k)?.size())).sum::<Option<usize>>()?;
        Some((before, scalar(place)?))
    }

    fn values(&self, at: usize, scalar: Scalar) -> impl Iterator<Item = f64> + '_ {
        let records = self.records.chunks_exact(self.stride.max(1));
        records.map(move |r| scalar.read(Endian::Little, &r[at..]).unwrap_or(f64::NAN))
    }

    /// Takes over the kept columns of a binary record.
    fn push(&mut self, record: &[u8], scalars: &[(Scalar, bool)], endian: Endian) {
        let mut at = 0;
        for (scalar, kept) in scalars {
            let value = &record[at..at + scalar.size()];
            at += scalar.size();
            match (kept, endian) {
                (false, _) => {}
                (true, Endian::Little) => self.records.extend_from_slice(value),
                (true, Endian::Big) => self.records.extend(value.iter().rev()),
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_are_kept_from_every_encoding() {
        let head = |encoding: &str| {
            format!(
                "ply\nformat {encoding} 1.0\nelement vertex 2\nproperty float x\nproperty float nx\n\
                 property float y\nproperty float z\nproperty uchar red\nproperty ushort intensity\nend_header\n"
            )
        };
        let rows = [(1f32, 0.5f32, 2f32, 3f32, 7u8, 300u16), (4.0, -0.25, 5.0, 6.0, 8, 301)];
        let mut little = head("binary_little_endian").into_bytes();
        let mut big = head("binary_big_endian").into_bytes();
        let mut ascii = head("ascii").into_bytes();
        let mut expected = Vec::new();
        for (x, n, y, z, red, intensity) in rows {
            for v in [x, n, y, z] {
                little.extend(v.to_le_bytes());
                big.extend(v.to_be_bytes());
            }
            little.push(red);
            big.push(red);
            little.extend(intensity.to_le_bytes());
            big.extend(intensity.to_be_bytes());
            ascii.extend(format!("{x} {n} {y} {z} {red} {intensity}\n").into_bytes());
            expected.extend(n.to_le_bytes());
            expected.push(red);
            expected.extend(intensity.to_le_bytes());
        }
        for bytes in [little, big, ascii] {
            let fields = Fields::of(&bytes);
            let names: Vec<_> = fields.columns.iter().map(|(n, t)| (n.as_str(), *t)).collect();
            assert_eq!(names, [("nx", "float"), ("red", "uchar"), ("intensity", "ushort")]);
            assert_eq!((fields.stride, &fields.records), (7, &expected));
        }
    }

    #[test]
    fn labels_and_normals_are_columns_of_their_names() {
        let text = "ply\nformat ascii 1.0\nelement vertex 2\nproperty float x\nproperty float y\n\
            property float z\nproperty uchar red\nproperty float nx\nproperty double ny\nproperty float nz\n\
            property int label\nend_header\n0 0 0 9 0 0.5 1 -1\n1 1 1 9 1 0 0 7\n";
        let fields = Fields::of(text.as_bytes());
        assert!(Fields::are_told(text.as_bytes()) && !Fields::are_told(b"1 2 3\n"));
        assert_eq!(fields.labels(), Some(vec![-1, 7]));
        assert_eq!(fields.normals(), Some(vec![[0.0, 0.5, 1.0], [1.0, 0.0, 0.0]]));
        let other =
            Fields::of(text.replace("int label", "float label").replace("nz", "n").as_bytes());
        assert_eq!((other.labels(), other.normals()), (None, None));
        assert!(!Fields::are_told(text.replace("label", "class").replace("nx", "n").as_bytes()));
        assert_eq!((Fields::default().labels(), Fields::default().normals()), (None, None));
    }

    #[test]
    fn what_is_no_ply_or_ends_early_has_none() {
        assert_eq!(Fields::of(b"1 2 3\n"), Fields::default());
        let short = b"ply\nformat binary_little_endian 1.0\nelement vertex 9\nproperty float x\n\
            property float y\nproperty float z\nproperty uchar a\nend_header\n12";
        assert_eq!(Fields::of(short), Fields::default());
    }
}
