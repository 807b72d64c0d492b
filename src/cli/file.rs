use std::{collections::BTreeMap, ffi::OsString, fs};

use clap::{
    Arg, ArgMatches, Command,
    error::{ContextKind, ContextValue},
};
use toml::Value;

use super::{environment::nearest, error::AnyError};

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
    /// It names a setting that is none.
    #[error(
        "the settings file {path}: '{name}' is no setting; the nearest is '{nearest}'. 'conicoid serve \
         --help' lists them"
    )]
    Unknown {
        /// The file.
        path: String,
        /// The name.
        name: String,
        /// The setting that is spelt most like it.
        nearest: String,
    },
    /// It gives a setting a table.
    #[error("the settings file {path}: '{name}' is no table, and has one")]
    Table {
        /// The file.
        path: String,
        /// The setting.
        name: String,
    },
    /// A value of it is not one its setting takes.
    #[error("the settings file {path}: {error}")]
    Value {
        /// The file.
        path: String,
        /// Which one, and why.
        error: String,
    },
}

/// The commands that have all settings.
const SERVING: [&str; 2] = ["serve", "worker"];

/// What `args` say to `command`, with the values of the settings file that they or the environment name
/// in place of the built-in defaults; flags and environment still come first.
///
/// # Errors
/// A flag or a variable is wrong, or the file cannot be read, is not TOML, or names something that is no
/// setting or gives it a wrong value.
pub fn matches(command: Command, args: &[OsString]) -> Result<ArgMatches, AnyError> {
    // what is wrong without the file is not the file's fault
    let found = command.clone().try_get_matches_from(args).map_err(without_password)?;
    let inner = SERVING.iter().find_map(|name| found.subcommand_matches(name)).unwrap_or(&found);
    let Some(path) = inner.try_get_one::<String>("config").ok().flatten().cloned() else {
        return Ok(found);
    };
    let command = with_values(command, &path)?;
    command.try_get_matches_from(args).map_err(|error| {
        let told = without_password(error).to_string();
        let told = told.lines().next().unwrap_or_default().trim_start_matches("error: ");
        FileError::Value { path, error: told.to_owned() }.into()
    })
}

/// The error without what may be a part of a password: of the address of a NATS server only the scheme is told.
fn without_password(mut error: clap::Error) -> clap::Error {
    let text = |kind| match error.get(kind) {
        Some(ContextValue::String(text)) => Some(text.clone()),
        _ => None,
    };
    let is_address = text(ContextKind::InvalidArg).is_some_and(|arg| arg.starts_with("--nats <"));
    if let Some(value) = text(ContextKind::InvalidValue).filter(|_| is_address) {
        let scheme = value.find("://").map_or("", |end| &value[..end + 3]);
        error.insert(ContextKind::InvalidValue, ContextValue::String(format!("{scheme}...")));
    }
    error
}

/// `command` with the values of the file at `path` as its defaults.
fn with_values(command: Command, path: &str) -> Result<Command, FileError> {
    let path = path.to_owned();
    let text =
        fs::read_to_string(&path).map_err(|error| FileError::Read { path: path.clone(), error })?;
    let values: BTreeMap<String, Value> = toml::from_str(&text)
        .map_err(|error| FileError::Toml { path: path.clone(), error: Box::new(error) })?;
    let values = values.into_iter().map(|(name, value)| {
        let known = name.replace('-', "_");
        if !settings(&command).any(|setting| setting == known) {
            let nearest = nearest(&known, settings(&command)).to_owned();
            return Err(FileError::Unknown { path: path.clone(), name, nearest });
        }
        let text = text_of(value).ok_or_else(|| FileError::Table { path: path.clone(), name })?;
        Ok((known, text))
    });
    let values = values.collect::<Result<BTreeMap<_, _>, _>>()?;
    let defaults = |arg: Arg| match values.get(arg.get_id().as_str()) {
        Some(texts) => arg.default_values(texts),
        None => arg,
    };
    let command = command.mut_args(defaults);
    let with_defaults =
        |command: Command, name| command.mut_subcommand(name, |serve| serve.mut_args(defaults));
    Ok(SERVING.into_iter().fold(command, with_defaults))
}

/// The settings that a file may name.
fn settings(command: &Command) -> impl Iterator<Item = &str> {
    command.get_arguments().map(|a| a.get_id().as_str()).filter(|id| *id != "config")
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
