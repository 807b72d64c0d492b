use std::{
    io::{self, Write},
    path::{Path, PathBuf},
};

use clap::{ArgMatches, Args, Command, FromArgMatches, error::ErrorKind};

use super::{
    error::AnyError,
    input::Input,
    output::{self, Output},
    segment::flag,
    settings::size_above_zero,
};
use crate::{
    formats::{Format, Limits},
    jobs::Control,
    service::{FitRequest, ParameterForm, Representation, compute_fit, fit_specs, render_fit},
};

/// Points of one feature and what to do with them.
#[derive(Debug, Args)]
pub struct FitArgs {
    /// The points, all of one feature; `-` reads standard input
    points: PathBuf,
    /// Where the result goes, in the form of its ending: .json, .pb, .qif, .dmo (DMIS output), .csv (characteristics). JSON to standard output when it is `-` or absent
    #[arg(short, long, value_name = "FILE")]
    output: Option<PathBuf>,
    /// Most points
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
struct RequestArgs(FitRequest);

impl Args for RequestArgs {
    fn augment_args(command: Command) -> Command {
        // variables of the environment would be those of segmentations
        command.args(fit_specs().map(|spec| flag(spec).env(None)))
    }

    fn augment_args_for_update(command: Command) -> Command {
        Self::augment_args(command)
    }
}

impl FromArgMatches for RequestArgs {
    fn from_arg_matches(matches: &ArgMatches) -> Result<Self, clap::Error> {
        let mut request = Self(FitRequest::default());
        request.update_from_arg_matches(matches)?;
        Ok(request)
    }

    fn update_from_arg_matches(&mut self, matches: &ArgMatches) -> Result<(), clap::Error> {
        for spec in fit_specs() {
            if let Some(value) = matches.get_one::<String>(spec.name) {
                let set = self.0.set(spec.name, value);
                set.map_err(|e| clap::Error::raw(ErrorKind::ValueValidation, format!("{e}\n")))?;
            }
        }
        Ok(())
    }
}

/// Reads, fits and writes.
pub fn run(args: &FitArgs) -> Result<(), AnyError> {
    let is_dash = |path: &Path| path.as_os_str() == "-";
    let mut request = args.request.0.clone();
    let extension = args.points.extension().and_then(|e| e.to_str());
    request.request.set_format(extension.and_then(Format::from_extension));
    if let (None, false, Some(name)) =
        (&request.request.name, is_dash(&args.points), args.points.file_name())
    {
        // it stays without a name where that is no text of one line
        let _ = request.set("name", &name.to_string_lossy());
    }
    let path = args.output.as_deref().filter(|path| !is_dash(path));
    let form = path.map_or(Ok(Representation::Json), output::fit_form)?;
    let output = path.map(|path| Output::new(path, &args.points)).transpose()?;
    let bytes = Input::open(&args.points)?;
    let deadline = request.request.deadline.map(|limit| std::time::Instant::now() + limit);
    let limits = Limits::of(args.max_points);
    let document = compute_fit(&bytes, &request, &limits, &Control::new(deadline))?;
    bytes.check_unchanged()?;
    let result = render_fit(form, document)?;
    match output {
        Some(output) => output.write(&result)?,
        None => io::stdout().lock().write_all(&result)?,
    }
    Ok(())
}
