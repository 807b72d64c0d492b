use prost::Message;

use super::{Document, message::v1};

/// A form in which a result can be told.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Representation {
    /// The whole result as JSON.
    Json,
    /// The whole result as the protobuf message `conicoid.v1.Segmentation`.
    Protobuf,
}

impl Representation {
    /// Every form, the default first.
    pub const ALL: &[Self] = &[Self::Json, Self::Protobuf];

    /// The media type it is sent under.
    pub fn media_type(self) -> &'static str {
        self.media_types()[0]
    }

    /// The media types it is asked for by.
    pub fn media_types(self) -> &'static [&'static str] {
        match self {
            Self::Json => &["application/json"],
            Self::Protobuf => &[
                "application/x-protobuf",
                "application/protobuf",
                "application/vnd.google.protobuf",
            ],
        }
    }

    /// Writes `document` in this form.
    ///
    /// # Errors
    /// A number of the result is not finite and has no place in JSON.
    pub fn render(self, document: Document) -> Result<Vec<u8>, serde_json::Error> {
        match self {
            Self::Json => serde_json::to_vec(&document),
            Self::Protobuf => Ok(v1::Segmentation::from(document).encode_to_vec()),
        }
    }
}
