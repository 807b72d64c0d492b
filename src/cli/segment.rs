use std::{
    fs,
    io::{self, IsTerminal, Write},
    num::NonZeroUsize,
    path::{Path, PathBuf},
    sync::Arc,
    thread,
};

use clap::{
    Arg, ArgMatches, Args, Command, FromArgMatches,
    builder::{PossibleValue, PossibleValuesParser, TypedValueParser},
    error::ErrorKind,
};
use indicatif::{ProgressBar, ProgressStyle};

use super::{
    error::AnyError,
    input::Input,
    output::{self, Output},
    result::Told,
    room,
    settings::{number_above_zero, size_above_zero},
    table::table,
};
use crate::{
    formats::{Format, FormatError, Limits, Packing},
    jobs::Control,
    segment::{ParameterKind, ParameterSpec},
    service::{Answer, Representation, Request, compute, specs},
};

/// One file and what to do with it.
#[derive(Debug, Args)]
pub struct SegmentArgs {
    /// The point cloud; `-` reads standard input
    cloud: PathBuf,
    /// Where the result goes, in the form its ending names: `result.json`, `report.html`, `picture.png`, `part.csv`
    /// (--output-format lists them). Standard output when it is `-`, and when it is absent and that is no terminal. The
    /// file is there when it is whole
    #[arg(short, long, value_name = "FILE")]
    output: Option<PathBuf>,
    /// Show neither progress nor a table of what was found; both come on standard error, on a terminal alone
    #[arg(short, long)]
    quiet: bool,
    /// Form of the result; the ending of the output's name tells it when absent, which must be one of
    /// these. Standard output gets JSON
    #[arg(long, value_name = "FORM", value_parser = forms())]
    output_format: Option<Representation>,
    /// Threads; one a processor when absent
    #[arg(long, env = "CONICOID_THREADS", value_name = "N", value_parser = number_above_zero)]
    threads: Option<NonZeroUsize>,
    /// Most points of the cloud
    #[arg(
        long,
        env = "CONICOID_MAX_POINTS",
        default_value_t = u32::MAX as usize,
        value_name = "N",
        value_parser = size_above_zero
    )]
    max_points: usize,
    #[command(flatten)]
    request: RequestArgs,
}

/// The request, one flag a row of the parameter table.
#[derive(Debug)]
struct RequestArgs(Request);

impl Args for RequestArgs {
    fn augment_args(command: Command) -> Command {
        command.args(specs().map(flag))
    }

    fn augment_args_for_update(command: Command) -> Command {
        Self::augment_args(command)
    }
}

/// The flag of one row.
pub(super) fn flag(spec: &'static ParameterSpec) -> Arg {
    let long = spec.name.replace('_', "-");
    let help = match spec.default {
        Some(default) => format!("{} [default: {default}]", spec.help),
        None => spec.help.to_owned(),
    };
    let arg = Arg::new(spec.name)
        .long(long)
        .help(help)
        .env(format!("CONICOID_{}", spec.name.to_ascii_uppercase()))
        .value_name(spec.unit.unwrap_or("VALUE").to_ascii_uppercase())
        .allow_hyphen_values(true);
    match spec.kind {
        _ if spec.name == "format" => arg.value_parser(formats()).ignore_case(true),
        ParameterKind::Choice(words) => arg.value_parser(PossibleValuesParser::new(words)),
        ParameterKind::Hints { .. } => arg.value_name("FILE|JSON"),
        // without a value it is true, and the next flag is none
        ParameterKind::Boolean => {
            arg.num_args(0..=1).default_missing_value("true").allow_hyphen_values(false)
        }
        _ => arg,
    }
}

/// Hints as they are given: JSON as it stands, anything else is the name of the file that holds it.
fn hints_of(value: &str) -> Result<String, clap::Error> {
    if value.trim().is_empty() || value.trim_start().starts_with(['[', '{']) {
        return Ok(value.to_owned());
    }
    fs::read_to_string(value).map_err(|e| {
        let text = format!(
            "--hints {value}: the file cannot be read: {e}; give JSON, or the name of a file that holds it\n"
        );
        clap::Error::raw(ErrorKind::ValueValidation, text)
    })
}

/// The formats of clouds, each by any of its endings.
fn formats() -> PossibleValuesParser {
    let value = |format: Format| PossibleValue::new(format.name()).aliases(format.extensions());
    Format::ALL.map(value).into()
}

/// The forms of a result, with what each holds.
fn forms() -> impl TypedValueParser<Value = Representation> {
    let value = |form: &Representation| PossibleValue::new(form.extension()).help(form.help());
    PossibleValuesParser::new(Representation::ALL.iter().map(value))
        .map(|name| Representation::from_extension(&name).unwrap_or(Representation::Json))
}

impl FromArgMatches for RequestArgs {
    fn from_arg_matches(matches: &ArgMatches) -> Result<Self, clap::Error> {
        let mut request = Self(Request::default());
        request.update_from_arg_matches(matches)?;
        Ok(request)
    }

    fn update_from_arg_matches(&mut self, matches: &ArgMatches) -> Result<(), clap::Error> {
        for spec in specs() {
            if let Some(value) = matches.get_one::<String>(spec.name) {
                let text = match spec.kind {
                    ParameterKind::Hints { .. } => hints_of(value)?,
                    _ => value.clone(),
                };
                let set = self.0.set(spec.name, &text);
                set.map_err(|e| clap::Error::raw(ErrorKind::ValueValidation, format!("{e}\n")))?;
            }
        }
        Ok(())
    }
}

/// Reads, segments and writes.
pub fn run(args: &SegmentArgs) -> Result<(), AnyError> {
    if let Some(threads) = args.threads {
        rayon::ThreadPoolBuilder::new().num_threads(threads.get()).build_global()?;
    }
    let mut request = args.request.0.clone();
    if request.format.is_none() {
        let extension = args.cloud.extension().and_then(|e| e.to_str());
        request.set_format(extension.and_then(Format::from_extension));
    }
    if let (None, false, Some(name)) = (&request.name, is_dash(&args.cloud), args.cloud.file_name())
    {
        // it stays without a name where that is no text of one line
        let _ = request.set("name", &name.to_string_lossy());
    }
    let output = args.output.as_deref().filter(|path| !is_dash(path));
    let form = match (args.output_format, output) {
        (Some(form), _) => form,
        (None, Some(path)) => output::form(path)?,
        (None, None) => Representation::Json,
    };
    // what cannot be written is told before the work is done
    let output = output.map(|path| Output::new(path, &args.cloud)).transpose()?;
    // a person who names no output wants to see what is there, not megabytes of labels
    let is_asked = args.output.is_some() || args.output_format.is_some();
    let is_written = is_asked || args.quiet || !io::stdout().is_terminal();
    let bytes = unpacked(Input::open(&args.cloud)?)?;
    let most_bytes = room::check(&bytes, request.hints(), args.max_points as u64, room::free())?;
    let limits = Limits { max_points: args.max_points, max_thin_bytes: most_bytes };
    let is_shown = !args.quiet && io::stderr().is_terminal();
    let answer = segment(&bytes, &request, &limits, is_shown)?;
    bytes.check_unchanged()?;
    let told = is_shown.then(|| table(&answer.document, request.name.as_deref().unwrap_or("-")));
    if is_written {
        let result = Told { answer, form, bytes: &bytes, request: &request, limits: &limits };
        match output {
            Some(output) => output.write_by(|out| result.write(out))?,
            None => result.write(&mut io::BufWriter::new(io::stdout()))?,
        }
    }
    if let Some(told) = told {
        // the result is written, and nobody may be reading this any more
        let hint = if is_written {
            ""
        } else {
            "\n-o result.json, report.html or picture.png keeps the result\n"
        };
        let _ = write!(io::stderr(), "{told}{hint}");
    }
    Ok(())
}

fn is_dash(path: &Path) -> bool {
    path.as_os_str() == "-"
}

/// The bytes of a file that gzip or zstd packed, or of any other as they are.
fn unpacked(input: Input) -> Result<Input, FormatError> {
    let Some(packing) = Packing::of(&input) else { return Ok(input) };
    let free = room::free();
    let count = |bytes| match bytes > free {
        true => Err(FormatError::NoMemoryToUnpack { bytes }),
        false => Ok(()),
    };
    packing.unpack(&input, count).map(Input::Bytes)
}

fn segment(
    bytes: &[u8],
    request: &Request,
    limits: &Limits,
    is_shown: bool,
) -> Result<Answer, AnyError> {
    let deadline = request.deadline.map(|limit| std::time::Instant::now() + limit);
    let control = Control::new(deadline);
    let bar = is_shown.then(|| show_progress(&control));
    let done = compute(bytes, request, limits, &control);
    if let Some(bar) = bar {
        bar.finish_and_clear();
    }
    Ok(done?)
}

/// A bar on the terminal that follows the run from a thread of its own.
fn show_progress(control: &Arc<Control>) -> ProgressBar {
    let style = ProgressStyle::with_template("{msg:8} {wide_bar} {percent}%");
    let bar =
        ProgressBar::new(100).with_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()));
    let (shown, mut progress) = (bar.clone(), control.watch());
    thread::spawn(move || {
        while !shown.is_finished() {
            if let Some(now) = *progress.borrow_and_update() {
                shown.set_message(now.stage.name());
                shown.set_position((now.fraction * 100.0) as u64);
            }
            thread::sleep(std::time::Duration::from_millis(50));
        }
    });
    bar
}
