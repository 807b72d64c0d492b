//! Clouds whose points many processes look at: see [`crate::segment::tiles`].
//!
//! The process that runs the job reads the cloud once, keeps it in parts of so many points in the order of the file,
//! and takes some points of each for the survey. The points of a part need not lie together: they are then a thinner
//! cloud of the same surfaces.

mod cutter;
mod rounds;
#[cfg(test)]
mod tests;
mod wire;

use std::time::Instant;

use bytes::Bytes;

use cutter::Cutter;
use rounds::Rounds;

use super::{
    Answer, Request, ServiceError, Timing,
    compute::{check_labels, named_otherwise, told},
};
use crate::{
    answer::{ErrorKind, sha256_unless},
    formats::{self, About, Fields, Format, Hints, Limits, Watched},
    geometry::PointCloud,
    jobs::{Control, Parts, PartsError, StoreError, trace},
    segment::{Monitor, Segmentation, Stage, tiles::Survey},
};

pub(super) use wire::label_part;

/// Whether and how clouds are cut.
pub(super) struct Cut<'a> {
    /// What is done with the parts.
    pub parts: &'a dyn Parts,
    /// Clouds of more points are cut into parts of at most so many.
    pub points: usize,
}

/// What has come of a cloud that was to be cut.
pub(super) enum Cutting {
    /// Its answer.
    Done(Box<Answer>),
    /// It is to be looked at as a whole after all: here it is.
    Whole(Bytes),
}

impl Cut<'_> {
    /// Whether a cloud in such bytes is cut.
    pub fn is_for(&self, bytes: &[u8], request: &Request) -> bool {
        let hints = request.hints();
        self.points > 0
            && hints.thin.is_none()
            && request.association.is_none()
            // what the file says of each point beside where it is stays with the whole
            && !(hints.format_of(bytes) == Some(Format::Ply) && Fields::are_told(bytes))
            && Survey::can(&request.parameters)
            && formats::is_handed_on(bytes, hints)
            && formats::announced_points(bytes, hints) > self.points as u64
    }

    /// Reads and segments a cloud in parts.
    ///
    /// # Errors
    /// As [`super::compute`], and those of the parts.
    pub fn answer(
        &self,
        bytes: Bytes,
        request: &Request,
        limits: &Limits,
        control: &Control,
    ) -> Result<Cutting, ServiceError> {
        let begin = Instant::now();
        let format = request.hints().format_of(&bytes);
        trace::note(|facts| {
            (facts.format, facts.bytes) = (format.map(Format::name), Some(bytes.len()));
        });
        let stopped = || control.stop().is_some();
        let hints = Hints { format, ..request.hints() };
        let (cut, sha256) = rayon::join(
            || self.cut(&bytes, hints, limits, control),
            || sha256_unless(&bytes, stopped),
        );
        let named = |error| named_otherwise(error, request.format, &bytes);
        let stopped_or = |error| control.stop().map_or(error, ServiceError::from);
        let Some((cutter, about)) = cut.map_err(|error| stopped_or(named(error)))? else {
            return Ok(Cutting::Whole(bytes));
        };
        // the parts have all of it
        drop(bytes);
        check_labels(cutter.len, request)?;
        let parse = begin.elapsed().as_secs_f64();
        let span = trace::step("segment");
        let found = span.in_scope(|| self.segment(cutter, about, request, control));
        let (cloud, found) = found.map_err(stopped_or)?;
        let total = begin.elapsed().as_secs_f64();
        let timing = Timing { parse, stages: control.finish(), total };
        let answer = told(&span, cloud, found, request, (sha256, format), timing);
        Ok(Cutting::Done(Box::new(answer)))
    }

    /// Cuts the cloud; nothing where it is to be looked at as a whole.
    fn cut(
        &self,
        bytes: &[u8],
        hints: Hints,
        limits: &Limits,
        control: &Control,
    ) -> Result<Option<(Cutter<'_>, About)>, ServiceError> {
        let stopped = || control.stop().is_some();
        let watched = Watched { limits: *limits, stopped: &stopped };
        let mut cutter = Cutter::new(self.parts, self.points);
        let read = trace::step("parse")
            .in_scope(|| formats::each_point(bytes, hints, &watched, &mut cutter));
        let ended = match cutter.failed.take() {
            Some(error) => Err(error),
            None if read.is_ok() => cutter.end(),
            None => Ok(()),
        };
        match ended {
            Ok(()) => {}
            Err(PartsError::Store(StoreError::Full(why))) => {
                tracing::warn!(why, "no room for the parts of a cloud: it is looked at as a whole");
                return Ok(None);
            }
            Err(error) => return Err(error.into()),
        }
        let about = read?;
        let is_whole = cutter.len <= self.points
            // whoever reads it as a whole says what is wrong with it
            || cutter.some.is_empty()
            || cutter.has_copies()
            || cutter.has_zeros();
        Ok((!is_whole).then_some((cutter, about)))
    }

    fn segment(
        &self,
        mut cutter: Cutter,
        about: About,
        request: &Request,
        control: &Control,
    ) -> Result<(PointCloud, Segmentation), ServiceError> {
        let some = about.cloud(std::mem::take(&mut cutter.some));
        let beside = std::mem::take(&mut cutter.beside);
        let survey = Survey::of(&some, &beside, &request.parameters, control)?;
        drop((some, beside));
        let (blobs, len) = (&cutter.blobs[..], cutter.len);
        let rounds = Rounds { parts: self.parts, blobs, len, size: self.points, control };
        let first = rounds.run(&survey.guide(), false)?;
        control.progress(Stage::Refine, 0.9);
        let judgement = survey.judged(&first.sums).map_err(|_| ServiceError::cancelled())?;
        let second = rounds.run(&judgement.guide(), true)?;
        control.progress(Stage::Report, 0.98);
        let found = judgement.report(&second.sums, second.finite, second.distinct);
        let found = found.map_err(|_| ServiceError::cancelled())?;
        let about = about.cloud(Vec::new());
        let cloud = PointCloud { input_len: cutter.len, elsewhere: second.finite, ..about };
        Ok((cloud, Segmentation { labels: second.labels, ..found }))
    }
}

impl From<PartsError> for ServiceError {
    fn from(error: PartsError) -> Self {
        match error {
            PartsError::Store(error) => error.into(),
            PartsError::Stopped => Self::cancelled(),
            PartsError::Failed { .. } => Self::new(ErrorKind::Internal, error.to_string()),
        }
    }
}
