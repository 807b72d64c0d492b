use std::{
    collections::HashMap,
    fmt, fs, io,
    path::{Path, PathBuf},
    sync::Arc,
};

use super::{ErrorKind, Peer, ServiceError, reread::Reread, sha256};

/// Why a key file cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum KeysError {
    /// It cannot be read.
    #[error("cannot read the key file {path}: {error}")]
    Read {
        /// The file.
        path: PathBuf,
        /// Why.
        error: io::Error,
    },
    /// A line is not `NAME SHA256`.
    #[error(
        "line {line} of the key file {path} is not 'NAME SHA256': make one with 'conicoid key NAME'"
    )]
    Line {
        /// The file.
        path: PathBuf,
        /// The line, from 1.
        line: usize,
    },
}

/// The API keys: a file with one `NAME SHA256` a line, comments after `#`.
///
/// The file is read again when it has changed, so a key is given or revoked without a restart. A
/// changed file that cannot be read leaves the last good keys in force.
pub struct Keys(Reread<Arc<Names>, KeysError>);

/// From the hash of a key to its name.
type Names = HashMap<String, String>;

impl fmt::Debug for Keys {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("Keys")
    }
}

impl Keys {
    /// Reads the file.
    ///
    /// # Errors
    /// It cannot be read, or a line of it is wrong.
    pub fn open(path: &Path) -> Result<Self, KeysError> {
        let read = path.to_owned();
        let read = move || {
            let names = names(&read)?;
            warn_if_empty(&read, &names);
            Ok(Arc::new(names))
        };
        Reread::open("the key file", vec![path.to_owned()], read).map(Self)
    }

    /// The name of the key `secret`, if it is one.
    pub fn name_of(&self, secret: &str) -> Option<String> {
        // looked up by its hash, so the time it takes tells nothing of the key
        self.0.latest().get(&sha256(secret.as_bytes())).cloned()
    }
}

/// A file without keys is how all are revoked, but more often a mistake.
fn warn_if_empty(path: &Path, names: &Names) {
    if names.is_empty() {
        let path = path.display();
        tracing::warn!(%path, "the key file has no keys: every caller is refused");
    }
}

fn names(path: &Path) -> Result<Names, KeysError> {
    let text = fs::read_to_string(path)
        .map_err(|error| KeysError::Read { path: path.to_owned(), error })?;
    let lines = text.lines().map(|line| line.split('#').next().unwrap_or_default().trim());
    let lines = lines.zip(1..).filter(|(line, _)| !line.is_empty());
    lines
        .map(|(text, line)| {
            entry(text).ok_or_else(|| KeysError::Line { path: path.to_owned(), line })
        })
        .collect()
}

/// The hash and the name of a line.
fn entry(line: &str) -> Option<(String, String)> {
    let (name, hash) = line.split_once(char::is_whitespace)?;
    let hash = hash.trim().to_ascii_lowercase();
    let good = hash.len() == 64 && hash.bytes().all(|b| b.is_ascii_hexdigit());
    good.then(|| (hash, name.to_owned()))
}

/// Who calls: the name of the key; where the service has none, the subject of the client certificate; or
/// nobody where it asks for neither.
pub type Caller = Option<String>;

/// Who sends this `Authorization` header over a connection of `peer`.
///
/// # Errors
/// The service asks for keys, and the header holds none of them.
pub fn caller(
    keys: Option<&Keys>,
    authorization: Option<&str>,
    peer: Option<&Peer>,
) -> Result<Caller, ServiceError> {
    let Some(keys) = keys else { return Ok(peer.map(|peer| peer.subject().to_owned())) };
    let refused = |detail| ServiceError::new(ErrorKind::Unauthenticated, detail);
    let header = authorization.ok_or_else(|| {
        refused("this service asks for an API key: send 'Authorization: Bearer KEY'")
    })?;
    let bearer = header.split_once(' ').filter(|(scheme, _)| scheme.eq_ignore_ascii_case("bearer"));
    let name = bearer.and_then(|(_, secret)| keys.name_of(secret.trim()));
    name.map(Some).ok_or_else(|| refused("the API key is not valid"))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn file(text: &str) -> (tempfile::TempDir, PathBuf) {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("keys");
        fs::write(&path, text).unwrap();
        (directory, path)
    }

    #[test]
    fn a_key_is_known_by_its_hash_until_it_is_revoked() {
        let line = format!("# team\nscanner {} # lab 2\n", sha256(b"secret"));
        let (_directory, path) = file(&line);
        let keys = Keys::open(&path).unwrap();
        let call = |header| caller(Some(&keys), header, None).map_err(|e| e.kind);
        assert_eq!(call(Some("Bearer secret")), Ok(Some("scanner".into())));
        assert_eq!(call(Some("bearer  secret")), Ok(Some("scanner".into())));
        for wrong in [None, Some("Bearer other"), Some("Basic secret"), Some("secret")] {
            assert_eq!(call(wrong), Err(ErrorKind::Unauthenticated));
        }
        fs::write(&path, "nobody here? no: a line that is wrong").unwrap();
        assert!(call(Some("Bearer secret")).is_ok());
        fs::write(&path, "# revoked\n").unwrap();
        assert_eq!(call(Some("Bearer secret")), Err(ErrorKind::Unauthenticated));
    }

    #[test]
    fn the_key_names_the_caller_and_without_keys_the_certificate_does() {
        let peer = Peer::named("CN=press 4");
        let (_directory, path) = file(&format!("scanner {}\n", sha256(b"secret")));
        let keys = Keys::open(&path).unwrap();
        let both = caller(Some(&keys), Some("Bearer secret"), Some(&peer));
        assert_eq!(both, Ok(Some("scanner".into())));
        // a certificate is no key
        assert!(caller(Some(&keys), None, Some(&peer)).is_err());
        assert_eq!(caller(None, Some("Bearer x"), Some(&peer)), Ok(Some("CN=press 4".into())));
        assert_eq!(caller(None, None, None), Ok(None));
    }

    #[test]
    fn a_wrong_line_is_named() {
        let (_directory, path) = file("# keys\nscanner abc\n");
        let error = Keys::open(&path).unwrap_err().to_string();
        assert!(error.contains("line 2"), "{error}");
    }
}
