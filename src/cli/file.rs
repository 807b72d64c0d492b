use std::{collections::BTreeMap, ffi::OsString, fs};

use clap::{Arg, Command};
use toml::Value;

/// Why a settings file is not used.
#[derive(Debug, thiserror::Error)]
pub enum FileError {
    /// It cannot be read.
    #[error("cannot read the settings file {path}: {error}")]
    Read {
        /// The file.
        path: String,
        /// Why.
        error: std::io::Error,
    },
    /// It is not TOML.
    #[error("the settings file {path} is not TOML: {error}")]
    Toml {
        /// The file.
        path: String,
        /// Why.
        error: Box<toml::de::Error>,
    },
    /// It names a setting that is none, or gives it a table.
    #[error("the settings file {path}: '{name}' is no setting; 'conicoid serve --help' lists them")]
    Unknown {
        /// The file.
        path: String,
        /// The name.
        name: String,
    },
}

/// `command` with the values of the settings file, which `args` or the environment name, in place of
/// the built-in defaults; flags and environment still come first.
///
/// # Errors
/// The file cannot be read, is not TOML, or names something that is no setting.
pub fn with_settings_file(command: Command, args: &[OsString]) -> Result<Command, FileError> {
    let found = command.clone().ignore_errors(true).try_get_matches_from(args).ok();
    let path = found.and_then(|matches| {
        let inner = matches.subcommand_matches("serve").unwrap_or(&matches);
        inner.try_get_one::<String>("config").ok().flatten().cloned()
    });
    let Some(path) = path else { return Ok(command) };
    let text =
        fs::read_to_string(&path).map_err(|error| FileError::Read { path: path.clone(), error })?;
    let values: BTreeMap<String, Value> = toml::from_str(&text)
        .map_err(|error| FileError::Toml { path: path.clone(), error: Box::new(error) })?;
    let values = values.into_iter().map(|(name, value)| {
        let known = name.replace('-', "_");
        let is_setting = known != "config" && command.get_arguments().any(|a| a.get_id() == &known);
        match text_of(value) {
            Some(text) if is_setting => Ok((known, text)),
            _ => Err(FileError::Unknown { path: path.clone(), name }),
        }
    });
    let values = values.collect::<Result<BTreeMap<_, _>, _>>()?;
    let defaults = |arg: Arg| match values.get(arg.get_id().as_str()) {
        Some(texts) => arg.default_values(texts),
        None => arg,
    };
    Ok(command.mut_args(defaults).mut_subcommand("serve", |serve| serve.mut_args(defaults)))
}

/// A value as the command line would give it; `None` for a table.
fn text_of(value: Value) -> Option<Vec<String>> {
    match value {
        Value::Table(_) => None,
        Value::Array(items) => {
            let texts = items.into_iter().map(text_of).collect::<Option<Vec<_>>>()?;
            Some(texts.concat())
        }
        Value::String(text) => Some(vec![text]),
        Value::Integer(number) => Some(vec![number.to_string()]),
        Value::Float(number) => Some(vec![number.to_string()]),
        Value::Boolean(yes) => Some(vec![yes.to_string()]),
        Value::Datetime(time) => Some(vec![time.to_string()]),
    }
}
