use std::{collections::HashMap, time::Duration};

use tonic::{Code, Status};
use tonic_types::{ErrorDetails, StatusExt};

use crate::service::ServiceError;

/// The domain of the error codes.
const DOMAIN: &str = "conicoid";

impl From<ServiceError> for Status {
    fn from(error: ServiceError) -> Self {
        let code = error.kind.row().grpc;
        with_code(error, code)
    }
}

/// The status of an error under a code that is not its row's.
pub fn with_code(error: ServiceError, code: Code) -> Status {
    error.count();
    let row = error.kind.row();
    let mut details = ErrorDetails::new();
    details.set_error_info(row.code, DOMAIN, HashMap::new());
    if let Some(seconds) = error.retry_after() {
        details.set_retry_info(Some(Duration::from_secs(seconds.into())));
    }
    Status::with_error_details(code, error.detail, details)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::service::ErrorKind;

    #[test]
    fn a_status_carries_the_code_of_the_error_table() {
        let status = Status::from(ServiceError::new(ErrorKind::Overloaded, "full"));
        assert_eq!((status.code(), status.message()), (tonic::Code::ResourceExhausted, "full"));
        let details = status.get_error_details();
        assert_eq!(details.error_info().map(|info| info.reason.as_str()), Some("overloaded"));
        assert!(details.retry_info().is_some());
    }
}
