use uuid::Uuid;

/// Longest request id taken over from a caller.
const MAX_BYTES: usize = 128;

/// The request id a caller sent where it is a decent one, a new one otherwise: letters, digits and
/// `-_.:/+=@`, so that it reads the same in every log, and cannot end a value or a line there.
pub fn request_id(sent: Option<&str>) -> String {
    let decent = |id: &&str| {
        (1..=MAX_BYTES).contains(&id.len())
            && id.bytes().all(|b| b.is_ascii_alphanumeric() || b"-_.:/+=@".contains(&b))
    };
    sent.filter(decent).map_or_else(|| Uuid::now_v7().to_string(), str::to_owned)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_id_of_safe_characters_is_taken_over_and_no_other() {
        let longest = "x".repeat(MAX_BYTES);
        for id in ["7", "Root=1-67891233-abcdef", "a/b+c==", "x@y.z:1_2", &longest] {
            assert_eq!(request_id(Some(id)), id);
        }
        let longer = "x".repeat(MAX_BYTES + 1);
        for id in ["", "a b", "a\"b", "a\nb", "a\u{1b}[2Jb", "{a}", "a,b", "ä", &longer] {
            assert_eq!(request_id(Some(id)).len(), 36, "{id}");
        }
        assert_ne!(request_id(None), request_id(None));
    }
}
