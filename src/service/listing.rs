use uuid::Uuid;

use super::{Caller, ErrorKind, Service, ServiceError};
use crate::jobs::{JobState, JobView};

/// Which of a caller's jobs to list.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Listing {
    states: Vec<JobState>,
    page_size: usize,
    before: Option<Uuid>,
}

/// Some of a caller's jobs.
#[derive(Clone, Debug)]
pub struct JobPage {
    /// The jobs, the newest first.
    pub jobs: Vec<JobView>,
    /// Asks for the page behind this one.
    pub next_page_token: Option<String>,
}

impl Listing {
    /// Jobs of a page where nothing else is asked for.
    pub const PAGE_SIZE: u64 = 100;
    /// Most jobs of one page.
    pub const MAX_PAGE_SIZE: u64 = 1000;

    /// Jobs in one of `states`, or in any where that is empty; the page that `page_token` asks for, or the first
    /// where it is empty.
    ///
    /// # Errors
    /// The page's size is out of its range, or its token is none.
    pub fn new(
        states: Vec<JobState>,
        page_size: Option<u64>,
        page_token: &str,
    ) -> Result<Self, ServiceError> {
        let invalid = |detail| ServiceError::new(ErrorKind::InvalidParameter, detail);
        let size = page_size.unwrap_or(Self::PAGE_SIZE);
        if !(1..=Self::MAX_PAGE_SIZE).contains(&size) {
            let most = Self::MAX_PAGE_SIZE;
            return Err(invalid(format!(
                "parameter 'page_size': '{size}' is not a whole number from 1 to {most}"
            )));
        }
        let token = Some(page_token).filter(|token| !token.is_empty());
        let before = token.map(Uuid::try_parse).transpose().map_err(|_| {
            let told: String = page_token.escape_default().take(64).collect();
            invalid(format!(
                "parameter 'page_token': '{told}' is no next_page_token of an earlier answer: leave it out for the \
                 first page"
            ))
        })?;
        Ok(Self { states, page_size: size as usize, before })
    }

    /// Reads the name and value pairs of a query; states are repeated or written with commas.
    ///
    /// # Errors
    /// A name is unknown or stands twice, or a value is not one it takes.
    pub fn from_pairs(pairs: Vec<(String, String)>) -> Result<Self, ServiceError> {
        let invalid = |detail| ServiceError::new(ErrorKind::InvalidParameter, detail);
        let (mut states, mut size, mut token) = (Vec::new(), None, None);
        for (name, value) in pairs {
            let text = value.trim();
            match name.as_str() {
                "state" => {
                    for word in text.split(',') {
                        states.push(JobState::from_name(word.trim()).ok_or_else(|| {
                            let known = JobState::ALL.map(JobState::name).join(", ");
                            invalid(format!("parameter 'state': '{word}' is not one of {known}"))
                        })?);
                    }
                }
                "page_size" if size.is_none() => {
                    size = Some(text.parse().map_err(|_| {
                        let most = Self::MAX_PAGE_SIZE;
                        invalid(format!(
                            "parameter 'page_size': '{text}' is not a whole number from 1 to {most}"
                        ))
                    })?);
                }
                "page_token" if token.is_none() => token = Some(text.to_owned()),
                "page_size" | "page_token" => {
                    return Err(invalid(format!("parameter '{name}' stands more than once")));
                }
                _ => {
                    return Err(ServiceError::new(
                        ErrorKind::UnknownParameter,
                        format!(
                            "unknown parameter '{name}' of a list of jobs; known ones: state, page_size, page_token"
                        ),
                    ));
                }
            }
        }
        Self::new(states, size, token.as_deref().unwrap_or_default())
    }
}

impl Service {
    /// The caller's jobs, the newest first. Callers of whom nobody asks who they are see all jobs of such callers.
    pub fn jobs(&self, caller: &Caller, listing: &Listing) -> JobPage {
        let Listing { states, page_size, before } = listing;
        let wanted = |state| states.is_empty() || states.contains(&state);
        // one more than asked for tells whether there is a next page
        let mut jobs = self.book().list(caller.as_deref(), *before, page_size + 1, wanted);
        let more = jobs.len() > *page_size;
        jobs.truncate(*page_size);
        let jobs: Vec<_> = jobs.iter().map(|job| job.view()).collect();
        let last = jobs.last().filter(|_| more);
        JobPage { next_page_token: last.map(|view| view.record.id.to_string()), jobs }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn listed(pairs: &[(&str, &str)]) -> Result<Listing, ErrorKind> {
        let pairs = pairs.iter().map(|(name, value)| ((*name).to_owned(), (*value).to_owned()));
        Listing::from_pairs(pairs.collect()).map_err(|error| error.kind)
    }

    #[test]
    fn a_page_has_one_job_to_a_thousand() {
        let size = |text| listed(&[("page_size", text)]).map(|listing| listing.page_size);
        assert_eq!((size("1"), size("1000")), (Ok(1), Ok(1000)));
        assert_eq!(listed(&[]).map(|listing| listing.page_size), Ok(100));
        for wrong in ["0", "1001", "-1", "1.0", "ten", ""] {
            assert_eq!(size(wrong), Err(ErrorKind::InvalidParameter), "{wrong}");
        }
    }

    #[test]
    fn states_are_repeated_or_written_with_commas_and_nothing_else_stands_twice() {
        let both = listed(&[("state", "queued, running"), ("state", "failed")]);
        let states = [JobState::Queued, JobState::Running, JobState::Failed];
        assert_eq!(both.map(|listing| listing.states), Ok(states.to_vec()));
        let twice = listed(&[("page_size", "1"), ("page_size", "1")]);
        assert_eq!(twice, Err(ErrorKind::InvalidParameter));
        assert_eq!(listed(&[("state", "done")]), Err(ErrorKind::InvalidParameter));
        assert_eq!(listed(&[("page_token", "x")]), Err(ErrorKind::InvalidParameter));
        assert_eq!(listed(&[("page", "1")]), Err(ErrorKind::UnknownParameter));
    }
}
