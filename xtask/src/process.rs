//! Runs other programs: it shows every command first, and an error names the failed one.

use std::cell::RefCell;
use std::fs::File;
use std::io::{BufRead, BufReader, Write};
use std::path::{Path, PathBuf};
use std::process::{Command, ExitStatus, Stdio};

use anyhow::{Context, Result, ensure};

thread_local! {
    /// The output of this thread and of its programs, if it is not the terminal.
    static LOG: RefCell<Option<File>> = const { RefCell::new(None) };
}

/// Runs `work` on this thread, with the output of it and its programs written to a file.
pub fn logged<T>(file: File, work: impl FnOnce() -> T) -> T {
    LOG.set(Some(file));
    let done = work();
    LOG.set(None);
    done
}

/// The standard output or error of a program.
fn printed() -> Stdio {
    LOG.with_borrow(|log| {
        let file = log.as_ref().and_then(|file| file.try_clone().ok());
        file.map_or_else(Stdio::inherit, Stdio::from)
    })
}

/// Prints a line to standard error, or to the log.
pub fn say(line: &str) {
    let written = LOG.with_borrow_mut(|log| log.as_mut().map(|file| writeln!(file, "{line}")));
    if written.is_none() {
        eprintln!("{line}");
    }
}

/// Prints text to standard output, or to the log.
pub fn print(text: &str) {
    match LOG.with_borrow(Option::is_some) {
        true => say(text),
        false => println!("{text}"),
    }
}

/// A command from words that have no spaces in them.
pub fn command(words: &str) -> Command {
    let (program, arguments) = words.split_once(' ').unwrap_or((words, ""));
    let mut command = Command::new(program);
    command.args(arguments.split_whitespace());
    command
}

/// Shows and runs the command with this program's own input and output.
pub fn run(command: &mut Command) -> Result<()> {
    say(&format!("+ {command:?}"));
    command.stdout(printed()).stderr(printed());
    let status = command.status().with_context(|| cannot_start(command))?;
    check(status, command)
}

/// Runs the command without showing it; returns its standard output.
pub fn output(command: &mut Command) -> Result<String> {
    let output = command.stderr(printed()).output();
    let output = output.with_context(|| cannot_start(command))?;
    check(output.status, command)?;
    Ok(String::from_utf8(output.stdout)?)
}

/// True if the command can be started and succeeds; its output is discarded.
pub fn succeeds(command: &mut Command) -> bool {
    let output = command.stdin(Stdio::null()).output();
    output.is_ok_and(|output| output.status.success())
}

/// Shows and runs the command; passes every line of its standard output to `each`.
pub fn for_each_line(command: &mut Command, mut each: impl FnMut(&str)) -> Result<()> {
    say(&format!("+ {command:?}"));
    let child = command.stdout(Stdio::piped()).stderr(printed()).spawn();
    let mut child = child.with_context(|| cannot_start(command))?;
    let output = child.stdout.take().context("no standard output")?;
    for line in BufReader::new(output).split(b'\n') {
        each(&String::from_utf8_lossy(&line?));
    }
    check(child.wait()?, command)
}

fn check(status: ExitStatus, command: &Command) -> Result<()> {
    ensure!(status.success(), "`{command:?}` failed ({status})");
    Ok(())
}

fn cannot_start(command: &Command) -> String {
    format!("cannot start `{command:?}`")
}

/// The first program of this name on `PATH`.
pub fn find_program(name: &str) -> Option<PathBuf> {
    let path = std::env::var_os("PATH")?;
    let mut files = std::env::split_paths(&path).map(|folder| folder.join(name));
    files.find(|file| file.is_file())
}

/// Makes a command look for programs in this folder first.
pub fn before_path(command: &mut Command, folder: &Path) -> Result<()> {
    let path = std::env::var_os("PATH").unwrap_or_default();
    let folders = std::iter::once(folder.to_owned()).chain(std::env::split_paths(&path));
    command.env("PATH", std::env::join_paths(folders)?);
    Ok(())
}

/// A file's text; an error names the file.
pub fn read(file: &Path) -> Result<String> {
    std::fs::read_to_string(file).with_context(|| format!("reading {}", file.display()))
}

/// Writes a file; an error names it.
pub fn write(file: &Path, text: &str) -> Result<()> {
    std::fs::write(file, text).with_context(|| format!("writing {}", file.display()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_a_thread_and_its_programs_print_is_logged_and_failures_are_named() {
        let path = std::env::temp_dir().join(format!("logged-{}.txt", std::process::id()));
        let mut lines = Vec::new();
        logged(File::create(&path).unwrap(), || {
            say("one");
            let mut shell = Command::new("sh");
            shell.args(["-c", "echo two; printf three; echo four >&2; exit 3"]);
            let failed = for_each_line(&mut shell, |line| lines.push(line.to_owned()));
            let error = failed.unwrap_err().to_string();
            assert!(error.contains("\"sh\"") && error.contains('3'), "{error}");
        });
        let text = read(&path).unwrap();
        std::fs::remove_file(&path).unwrap();
        assert!(
            text.starts_with("one\n+ ") && text.ends_with("\nfour\n"),
            "{text}"
        );
        assert_eq!(lines, ["two", "three"]);
    }
}
