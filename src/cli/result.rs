//! A result as it is written, without holding it whole.

use std::{
    io::{self, Write},
    sync::Arc,
};

use crate::{
    formats::{self, Bounds, EachPoint, Fields, FormatError, Hints, Limits, Sink, TakePoints},
    geometry::{Thinned, Vec3},
    service::{Answer, Representation, Request, render},
};

/// What was found, and what it is written from.
#[derive(Debug)]
pub struct Told<'a> {
    /// What was found.
    pub answer: Answer,
    /// The form it is written in.
    pub form: Representation,
    /// The cloud's file.
    pub bytes: &'a [u8],
    /// What was asked for.
    pub request: &'a Request,
    /// The limits of the cloud.
    pub limits: &'a Limits,
}

impl Told<'_> {
    /// Writes it.
    ///
    /// # Errors
    /// `out` fails, or the answer has no place in the form.
    pub fn write(self, out: &mut (impl Write + Send)) -> io::Result<()> {
        let Self { mut answer, form, bytes, request, limits } = self;
        // of a thinned cloud they are read with its points, where that is quickly done
        let later = answer.cloud.thinned.is_some() && Fields::are_in_place(bytes);
        if form.has_points() {
            answer.fields =
                if later { Fields::of_some(bytes, Some(&[])) } else { Fields::of(bytes) };
        }
        if form == Representation::Protobuf {
            let result = render(form, answer, request.labels).map_err(io::Error::other)?;
            out.write_all(&result)?;
            return out.flush();
        }
        let cloud = Arc::clone(&answer.cloud);
        let written = match &cloud.thinned {
            Some(thinned) => {
                let hints = request.hints();
                let points = FilePoints { bytes, hints, limits, thinned, has_records: later };
                form.write_to(out, answer, request.labels, &points)
            }
            None => form.write_to(out, answer, request.labels, &*cloud),
        };
        written.map_err(io::Error::other)?;
        if form == Representation::Json {
            out.write_all(b"\n")?;
        }
        out.flush()
    }
}

/// The points of a cloud that was thinned, read from its file once more.
struct FilePoints<'a> {
    bytes: &'a [u8],
    hints: Hints,
    limits: &'a dyn Bounds,
    thinned: &'a Thinned,
    /// Whether the file's own columns are read with the points.
    has_records: bool,
}

impl EachPoint for FilePoints<'_> {
    fn records(&self, first: usize, count: usize) -> Option<Vec<u8>> {
        let places = || (first as u32..).take(count).collect::<Vec<_>>();
        self.has_records.then(|| Fields::of_some(self.bytes, Some(&places())).records)
    }

    fn each_point(&self, take: &mut TakePoints) -> io::Result<()> {
        let mut sink =
            Finite { take, thinned: self.thinned, first: 0, block: Vec::new(), failed: None };
        let read = formats::each_point(self.bytes, self.hints, self.limits, &mut sink);
        match sink.failed {
            Some(error) => Err(error),
            None => read.map(drop).map_err(io::Error::other),
        }
    }
}

/// Hands points on with NaN for those that were left out.
struct Finite<'a, 'b> {
    take: &'a mut TakePoints<'b>,
    thinned: &'a Thinned,
    first: usize,
    block: Vec<Vec3>,
    failed: Option<io::Error>,
}

impl Sink for Finite<'_, '_> {
    fn expect(&mut self, _: u64) -> Result<(), FormatError> {
        Ok(())
    }

    fn take(&mut self, points: &[Vec3]) -> Result<(), FormatError> {
        let nearest = self.thinned.nearest.get(self.first..).unwrap_or_default();
        let finite = |(p, near): (&Vec3, &u32)| match *near {
            Thinned::NONE => Vec3::repeat(f64::NAN),
            _ => *p,
        };
        self.first += points.len();
        self.block.clear();
        self.block.extend(points.iter().zip(nearest).map(finite));
        (self.take)(&self.block).map_err(|error| {
            self.failed = Some(error);
            FormatError::Stopped
        })
    }
}
