//! The command line as somebody at a terminal sees it: on a pseudo-terminal.

use std::{
    fs::{self, File},
    io::Read,
    process::{Command, Stdio},
};

use rustix::pty::{OpenptFlags, grantpt, openpt, ptsname, unlockpt};

use super::support::clouds;

/// A pseudo-terminal: the side where a person reads, and the side where a program writes.
fn terminal() -> (File, File) {
    let person = openpt(OpenptFlags::RDWR | OpenptFlags::NOCTTY).unwrap();
    grantpt(&person).unwrap();
    unlockpt(&person).unwrap();
    let name = ptsname(&person, Vec::new()).unwrap();
    let program = File::options().read(true).write(true).open(name.to_str().unwrap()).unwrap();
    (person.into(), program)
}

/// What a terminal shows until the programs at it have ended.
fn shown(mut terminal: File) -> String {
    let (mut bytes, mut block) = (Vec::new(), [0; 4096]);
    // it ends with an error when nobody has it open any more
    while let Ok(n @ 1..) = terminal.read(&mut block) {
        bytes.extend_from_slice(&block[..n]);
    }
    String::from_utf8_lossy(&bytes).replace("\r\n", "\n")
}

/// Runs `conicoid` in `directory` with a terminal for its standard error, and for its standard output where
/// `output` says so: what the terminal shows, and what else comes out.
fn run(directory: &std::path::Path, args: &[&str], output: bool) -> (String, Vec<u8>) {
    let (person, program) = terminal();
    let mut command = Command::new(env!("CARGO_BIN_EXE_conicoid"));
    command.args(args).current_dir(directory).stdin(Stdio::null());
    command.stdout(if output { program.try_clone().unwrap().into() } else { Stdio::piped() });
    let mut child = command.stderr(Stdio::from(program)).spawn().unwrap();
    // the command holds the program's side of the terminal open
    drop(command);
    let reader = std::thread::spawn(move || shown(person));
    let mut rest = Vec::new();
    if let Some(mut stdout) = child.stdout.take() {
        stdout.read_to_end(&mut rest).unwrap();
    }
    let status = child.wait().unwrap();
    let text = reader.join().unwrap();
    assert!(status.success(), "{text}");
    (text, rest)
}

fn bracket() -> tempfile::TempDir {
    let directory = tempfile::tempdir().unwrap();
    fs::write(directory.path().join("bracket.ply"), clouds::ply(&clouds::bracket(6000))).unwrap();
    directory
}

#[test]
fn a_table_of_what_was_found_stands_on_the_terminal_beside_the_result() {
    let directory = bracket();
    let (text, result) = run(directory.path(), &["bracket.ply"], false);
    let document: serde_json::Value = serde_json::from_slice(&result).unwrap();
    for told in ["bracket.ply: ", " surfaces in 6,000 points", "noise ", "tolerance ", "diameter "]
    {
        assert!(text.contains(told), "{told}: {text}");
    }
    // one row a surface, under the names
    let rows = text.lines().skip_while(|line| !line.contains("dimensions")).skip(1);
    let rows = rows.take_while(|line| !line.is_empty()).count();
    assert_eq!(rows, document["regions"].as_array().unwrap().len(), "{text}");
}

#[test]
fn a_person_who_names_no_output_sees_the_table_and_no_document() {
    let directory = bracket();
    let (text, _) = run(directory.path(), &["bracket.ply"], true);
    assert!(text.contains("dimensions") && text.contains("-o result.json"), "{text}");
    assert!(!text.contains("\"regions\""), "{text}");
    let (text, _) = run(directory.path(), &["bracket.ply", "-o", "-"], true);
    assert!(text.contains("\"regions\""), "{text}");
}

#[test]
fn quiet_runs_say_nothing() {
    let directory = bracket();
    let (text, _) = run(directory.path(), &["bracket.ply", "--quiet", "-o", "a.png"], true);
    assert_eq!(text, "");
    assert!(fs::read(directory.path().join("a.png")).unwrap().starts_with(b"\x89PNG"));
}

#[test]
fn the_service_says_on_a_terminal_what_it_is_and_how_it_stops() {
    let (person, program) = terminal();
    let ports = ["--http=127.0.0.1:0", "--grpc=127.0.0.1:0", "--admin=127.0.0.1:0"];
    let mut command = Command::new(env!("CARGO_BIN_EXE_conicoid"));
    command.args(ports).stdin(Stdio::null()).stdout(Stdio::null());
    let mut child = command.stderr(Stdio::from(program)).spawn().unwrap();
    drop(command);
    let mut text = String::new();
    let mut person = person;
    let mut block = [0; 4096];
    while !text.contains("Ctrl+C") {
        let n = person.read(&mut block).unwrap();
        text += &String::from_utf8_lossy(&block[..n]);
    }
    for told in ["conicoid ", "http://127.0.0.1:", "/docs", "conicoid part.ply"] {
        assert!(text.contains(told), "{told}: {text}");
    }
    assert!(!text.contains("127.0.0.1:0/"), "{text}");
    child.kill().unwrap();
    child.wait().unwrap();
}

#[test]
fn nobody_is_greeted_who_is_no_terminal() {
    let directory = bracket();
    let cloud = directory.path().join("bracket.ply").display().to_string();
    let run = super::support::conicoid(&[&cloud], None);
    assert!(run.status.success() && run.stderr.is_empty());
    assert!(run.stdout.starts_with(b"{\"conicoid\""));
}

#[test]
fn a_misspelt_command_is_told_as_one_and_a_missing_cloud_as_that() {
    let told = |args: &[&str]| {
        let run = super::support::conicoid(args, None);
        assert!(!run.status.success());
        String::from_utf8(run.stderr).unwrap()
    };
    assert!(told(&["serv"]).contains("'serve'"), "{}", told(&["serv"]));
    assert!(told(&["nowhere.ply"]).contains("cannot read nowhere.ply"));
    // an ending that names no form is refused before the cloud is read
    assert!(told(&["nowhere.ply", "-o", "a.xlsx"]).contains(".html, .png"));
}
