use prost::Message;

use super::{Answer, FitDocument, Representation, ServiceError, message::v1};

/// Writes `answer` in a form, protobuf among them; `labels` says whether JSON and protobuf hold the labels.
///
/// # Errors
/// The answer has no place in this form.
pub fn render(form: Representation, answer: Answer, labels: bool) -> Result<Vec<u8>, ServiceError> {
    match form {
        Representation::Protobuf => {
            Ok(v1::Segmentation::from(answer.document.shown(labels)).encode_to_vec())
        }
        form => form.write(answer, labels),
    }
}

/// Writes a fit in a form, protobuf among them.
///
/// # Errors
/// A fit has no such form.
pub fn render_fit(form: Representation, fit: FitDocument) -> Result<Vec<u8>, ServiceError> {
    match form {
        Representation::Protobuf => Ok(v1::FitResult::from(fit).encode_to_vec()),
        form => fit.write(form),
    }
}
