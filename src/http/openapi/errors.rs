use std::collections::BTreeMap;

use serde_json::{Value, json};
use utoipa::ToSchema;
use utoipa::openapi::{Content, Ref, ResponseBuilder, path::Operation};

use super::super::problem::{self, Problem};
use crate::service::{ERRORS, ErrorKind, ErrorRow};

/// The operations that ask nobody for a key.
pub const OPEN: [&str; 3] = ["getOpenApi", "getDocs", "getViewer"];

/// Where the document lists the codes. An extension, for in a schema a list of words is a closed one:
/// clients made from it would fail at the first new code.
pub const ERROR_CODES: &str = "x-error-codes";

/// Every code a problem document may have, those of no described path and method among them.
pub fn error_codes() -> Value {
    let code = |row: &ErrorRow| json!({"code": row.code, "status": row.status, "title": row.title});
    ERRORS.iter().map(code).collect()
}

/// One response for each status an operation may answer with, listing the codes of that status.
pub fn add_errors(operation: &mut Operation, id: &str) {
    let mut by_status: BTreeMap<u16, Vec<&ErrorRow>> = BTreeMap::new();
    for row in ERRORS.iter().filter(|row| applies(row.kind, id)) {
        by_status.entry(row.status).or_default().push(row);
    }
    for (status, rows) in by_status {
        let codes: Vec<_> = rows.iter().map(|r| format!("`{}`: {}", r.code, r.title)).collect();
        let schema = Content::new(Some(Ref::from_schema_name(Problem::name())));
        let response = ResponseBuilder::new()
            .description(codes.join(". "))
            .content(problem::MEDIA_TYPE, schema)
            .build();
        operation.responses.responses.insert(status.to_string(), response.into());
    }
}

/// Whether an operation can fail in this way.
fn applies(kind: ErrorKind, id: &str) -> bool {
    use ErrorKind as K;
    let result = id == "getJobResult";
    let (open, waits) = (OPEN.contains(&id), id.starts_with("createSegmentation"));
    let (fits, jobs) = (id.starts_with("createFit"), id.starts_with("createJob"));
    let segments = waits || jobs;
    let takes_cloud = segments || fits;
    match kind {
        K::Internal | K::MalformedRequest => true,
        // every path has these; they are the answer to another path or method than described
        K::NotFound | K::MethodNotAllowed => false,
        // what a job says of itself, and what gRPC alone says
        K::RunCrashed | K::AnswerTooLarge => false,
        K::Unauthenticated => !open,
        K::JobNotFound => result || ["getJob", "deleteJob", "getJobEvents"].contains(&id),
        K::JobNotFinished | K::JobFailed | K::StorageDamaged => result,
        K::Overloaded | K::QuotaExceeded => result || takes_cloud,
        K::StorageFull => id == "deleteJob" || segments,
        K::StorageFailed => result || id == "deleteJob" || segments,
        K::NotAcceptable => result || waits || fits,
        K::UnknownParameter | K::InvalidParameter => {
            result || takes_cloud || ["listJobs", "getJob"].contains(&id)
        }
        // what only shows when the cloud is read
        K::MalformedCloud
        | K::NoFinitePoints
        | K::TooFewPoints
        | K::ExtentOutOfRange
        | K::DeadlineExceeded
        | K::Cancelled => waits || fits,
        K::IdempotencyKeyReused => segments,
        K::NotDetermined => fits,
        _ => takes_cloud,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_code_stands_in_the_document() {
        let document = serde_json::to_value(super::super::super::openapi()).unwrap();
        let codes = document[ERROR_CODES].as_array().unwrap();
        assert!(ERRORS.iter().all(|row| codes.iter().any(|code| code["code"] == row.code)));
    }
}
