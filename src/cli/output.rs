use std::{
    fs::{self, File, Permissions},
    io::{self, BufWriter, Write},
    path::{Path, PathBuf},
};

use crate::service::{FitDocument, Representation};

/// Bytes that are written at a time.
const BUFFER: usize = 1 << 18;

/// Why a result is not written.
#[derive(Debug, thiserror::Error)]
pub enum OutputError {
    /// The name's ending tells no form.
    #[error(
        "the ending of the output {path} names no form of a result: end it in {known}, or give \
         --output-format", path = .0.display(), known = endings()
    )]
    Ending(PathBuf),
    /// The name's ending tells no form of a fit.
    #[error(
        "the ending of the output {} names no form of a fit: end it in .json, .pb, .qif, .dmo or .csv", .0.display()
    )]
    FitEnding(PathBuf),
    /// It would take the place of the cloud it is made from.
    #[error("the output {} is the cloud itself: give it another name", .0.display())]
    Input(PathBuf),
    /// It cannot be written.
    #[error("cannot write {}: {error}", path.display())]
    Write {
        /// The output.
        path: PathBuf,
        /// Why.
        error: io::Error,
    },
}

fn endings() -> String {
    let endings = Representation::ALL.iter().map(|form| format!(".{}", form.extension()));
    endings.collect::<Vec<_>>().join(", ")
}

/// The form that the ending of `path` names.
///
/// # Errors
/// It has no ending, or one of no form.
pub fn form(path: &Path) -> Result<Representation, OutputError> {
    let name = path.file_name().and_then(|name| name.to_str()).unwrap_or_default();
    // something must stand before the dot
    let dots = name.char_indices().skip(1).filter(|(_, c)| *c == '.');
    let mut endings = dots.map(|(at, _)| &name[at + 1..]);
    // the longest comes first: one form may end as another does
    endings
        .find_map(Representation::from_extension)
        .ok_or_else(|| OutputError::Ending(path.to_owned()))
}

/// The form of a fit that the ending of `path` names.
///
/// # Errors
/// It has no ending, or one of no form that a fit has.
pub fn fit_form(path: &Path) -> Result<Representation, OutputError> {
    let ending = path.extension().and_then(|ending| ending.to_str()).unwrap_or_default();
    FitDocument::form_from_extension(ending).ok_or_else(|| OutputError::FitEnding(path.to_owned()))
}

/// A file that comes into being, or changes, whole or not at all.
#[derive(Debug)]
pub struct Output {
    path: PathBuf,
    // where a link leads
    place: PathBuf,
    kind: Kind,
}

#[derive(Debug)]
enum Kind {
    New,
    /// It keeps who may read it.
    Replaced(Permissions),
    /// A pipe, a terminal: what is written is gone at once.
    Stream,
}

impl Output {
    /// Makes sure that `path` can be written and is not the file `input`; leaves nothing behind.
    ///
    /// # Errors
    /// It is the input, its directory is not there, or the system does not allow it.
    pub fn new(path: &Path, input: &Path) -> Result<Self, OutputError> {
        let cannot = |error| OutputError::Write { path: path.to_owned(), error };
        let place = path.canonicalize().unwrap_or_else(|_| path.to_owned());
        let kind = match fs::metadata(&place) {
            Err(error) if error.kind() == io::ErrorKind::NotFound => Kind::New,
            Err(error) => return Err(cannot(error)),
            Ok(_) if input.canonicalize().is_ok_and(|input| input == place) => {
                return Err(OutputError::Input(path.to_owned()));
            }
            Ok(file) if file.is_file() => Kind::Replaced(file.permissions()),
            Ok(file) if file.is_dir() => return Err(cannot(io::ErrorKind::IsADirectory.into())),
            Ok(_) => Kind::Stream,
        };
        let output = Self { path: path.to_owned(), place, kind };
        output.check().map_err(cannot)?;
        Ok(output)
    }

    fn check(&self) -> io::Result<()> {
        match self.kind {
            Kind::Stream => return Ok(()),
            Kind::Replaced(_) => drop(File::options().write(true).open(&self.place)?),
            Kind::New => {}
        }
        let draft = self.draft();
        File::create_new(&draft)?;
        fs::remove_file(draft)
    }

    /// Where it is written before it takes its place.
    fn draft(&self) -> PathBuf {
        let mut name = std::ffi::OsString::from(".");
        name.push(self.place.file_name().unwrap_or_default());
        name.push(format!(".{}.part", std::process::id()));
        self.place.with_file_name(name)
    }

    /// Writes it.
    ///
    /// # Errors
    /// The system does not take it; then what was there before is there still.
    pub fn write(&self, bytes: &[u8]) -> Result<(), OutputError> {
        self.write_by(|out| out.write_all(bytes))
    }

    /// Writes what `write` gives, as it comes.
    ///
    /// # Errors
    /// `write` fails, or the system does not take it; then what was there before is there still.
    pub fn write_by(
        &self,
        write: impl FnOnce(&mut BufWriter<File>) -> io::Result<()>,
    ) -> Result<(), OutputError> {
        let to = |file: File| {
            let mut out = BufWriter::with_capacity(BUFFER, file);
            write(&mut out)?;
            out.flush()
        };
        let written = match &self.kind {
            Kind::Stream => File::options().write(true).open(&self.place).and_then(to),
            Kind::New => self.replace(to, None),
            Kind::Replaced(permissions) => self.replace(to, Some(permissions.clone())),
        };
        written.map_err(|error| OutputError::Write { path: self.path.clone(), error })
    }

    fn replace(
        &self,
        write: impl FnOnce(File) -> io::Result<()>,
        permissions: Option<Permissions>,
    ) -> io::Result<()> {
        let draft = self.draft();
        let written = File::create_new(&draft).and_then(|file| {
            permissions.map_or(Ok(()), |permissions| file.set_permissions(permissions))?;
            write(file)?;
            fs::rename(&draft, &self.place)
        });
        if written.is_err() {
            // it may not be there
            let _ = fs::remove_file(&draft);
        }
        written
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_form_has_its_ending_and_no_other_ending_has_one() {
        for form in Representation::ALL {
            for name in [form.extension().to_owned(), form.extension().to_uppercase()] {
                let path = PathBuf::from(format!("part.{name}"));
                assert_eq!(super::form(&path).unwrap(), form);
            }
        }
        assert_eq!(super::form(Path::new("part.stp")).unwrap(), Representation::Step);
        for name in ["part.iges", "part.jsn", "part.json.gz", "part", "part.", ".json"] {
            let told = super::form(Path::new(name)).unwrap_err().to_string();
            assert!(told.contains(name) && told.contains(".json, .pb"), "{told}");
        }
    }

    #[test]
    fn a_write_that_fails_leaves_what_was_there() {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("part.json");
        fs::write(&path, "before").unwrap();
        let output = Output::new(&path, Path::new("-")).unwrap();
        // another file has the draft's name
        fs::create_dir(output.draft()).unwrap();
        assert!(output.write(b"after").is_err());
        assert_eq!(fs::read(&path).unwrap(), b"before");
        fs::remove_dir(output.draft()).unwrap();
        output.write(b"after").unwrap();
        assert_eq!(fs::read(&path).unwrap(), b"after");
        assert_eq!(fs::read_dir(directory.path()).unwrap().count(), 1);
    }
}
