//! How results go out: in one message that the caller can take, in pieces, or as a file.

use std::pin::Pin;

use bytes::Bytes;
use futures::{Stream, stream};
use prost::Message;
use tonic::{Response, Status};

use crate::{
    jobs::BytesHeld,
    service::{
        Document, ErrorKind, Representation, ServiceError,
        message::{Pieces, v1},
    },
};

/// What most clients take of one message, where nobody tells them to take more.
pub const CLIENTS_TAKE: u64 = 4_194_304;
/// Bytes of one chunk of a file.
const CHUNK: usize = 256 << 10;

/// The messages of a streamed answer.
pub type Messages<T> = Pin<Box<dyn Stream<Item = Result<T, Status>> + Send>>;

/// The result in one message of at most `most` bytes.
///
/// # Errors
/// It has more.
pub fn whole(document: Document, most: u64) -> Result<v1::Segmentation, ServiceError> {
    let message = v1::Segmentation::from(document);
    let bytes = message.encoded_len() as u64;
    if bytes <= most { Ok(message) } else { Err(ServiceError::answer_too_large(bytes, most)) }
}

/// The result in pieces, which hold `held` until the last is sent.
pub fn pieces(document: Document, held: BytesHeld) -> Response<Messages<v1::Segmentation>> {
    let faces = document.face_labels.as_deref().map_or(0, size_of_val);
    let labels = (size_of_val(document.labels()) + faces) as u64;
    // the work is done, so an answer that the budget has no room for goes out all the same
    let _ = held.grow_to(labels);
    let pieces = Pieces::of(document).map(move |piece| {
        let _held = &held;
        Ok(piece)
    });
    Response::new(Box::pin(stream::iter(pieces)))
}

/// A file in chunks.
pub fn file(bytes: Bytes) -> Response<Messages<v1::FileChunk>> {
    let starts = (0..bytes.len()).step_by(CHUNK);
    let chunks = starts.map(move |start| {
        let end = bytes.len().min(start + CHUNK);
        Ok(v1::FileChunk { data: bytes.slice(start..end) })
    });
    Response::new(Box::pin(stream::iter(chunks)))
}

/// The form that a message names, of those `offered`.
///
/// # Errors
/// It names none of them.
pub fn form(number: i32, offered: &[Representation]) -> Result<Representation, ServiceError> {
    let named = v1::Representation::try_from(number).ok();
    let named = named.filter(|form| *form != v1::Representation::Unspecified);
    let form = named.and_then(|form| Representation::from_name(name(form)));
    form.filter(|form| offered.contains(form)).ok_or_else(|| {
        let known: Vec<_> = offered.iter().map(|form| form.name()).collect();
        let given = named.map_or_else(|| number.to_string(), |form| name(form).to_owned());
        ServiceError::new(
            ErrorKind::InvalidParameter,
            format!(
                "field 'representation': {given} is no form of this result; known ones: {}",
                known.join(", ").to_uppercase()
            ),
        )
    })
}

/// The form's name without what all names of the enum begin with.
fn name(form: v1::Representation) -> &'static str {
    form.as_str_name().trim_start_matches("REPRESENTATION_")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::service::FitDocument;

    #[test]
    fn every_form_has_its_name_in_the_contract_and_every_name_is_one() {
        let named: Vec<_> =
            (1..).map_while(|number| form(number, &Representation::ALL).ok()).collect();
        assert_eq!(named, Representation::ALL);
        for wrong in [-1, 0, named.len() as i32 + 1] {
            let refused = form(wrong, &Representation::ALL).unwrap_err();
            assert_eq!(refused.kind, ErrorKind::InvalidParameter);
        }
        for wrong in [v1::Representation::Step, v1::Representation::Unspecified] {
            let told = form(wrong.into(), &FitDocument::OFFERED).unwrap_err().detail;
            assert!(told.contains("QIF") && told.matches("STEP").count() <= 1, "{told}");
        }
    }

    #[tokio::test]
    async fn chunks_are_the_file_and_fit_into_a_message() {
        use futures::StreamExt;
        for length in [0, 1, CHUNK, CHUNK + 1, 3 * CHUNK] {
            let bytes: Vec<u8> = (0..length).map(|k| k as u8).collect();
            let chunks = file(bytes.clone().into()).into_inner().collect::<Vec<_>>();
            let chunks: Vec<_> =
                chunks.await.into_iter().map(|chunk| chunk.unwrap().data).collect();
            assert!(chunks.iter().all(|chunk| (1..=CHUNK).contains(&chunk.len())));
            assert_eq!(chunks.concat(), bytes);
        }
    }
}
