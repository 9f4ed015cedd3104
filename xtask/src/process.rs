//! Running other programs: every command is shown first, and an error names the one that failed.

use std::cell::RefCell;
use std::ffi::OsStr;
use std::fs::File;
use std::io::{self, BufRead, BufReader, Write};
use std::path::PathBuf;
use std::process::{Command, ExitStatus, Stdio};

use anyhow::{Context, Result, bail};

thread_local! {
    /// Where this thread and the programs that it runs print, where that is not the terminal.
    static ASIDE: RefCell<Option<File>> = const { RefCell::new(None) };
}

/// Does `work` on this thread, with what it and its programs print put into a file: so that what is
/// done side by side can be read.
pub fn aside<T>(file: File, work: impl FnOnce() -> T) -> T {
    ASIDE.set(Some(file));
    let done = work();
    ASIDE.set(None);
    done
}

/// What a program's standard output or error becomes.
fn printed() -> Stdio {
    ASIDE.with_borrow(|aside| {
        let file = aside.as_ref().and_then(|file| file.try_clone().ok());
        file.map_or_else(Stdio::inherit, Stdio::from)
    })
}

/// Says a line on standard error, or aside.
pub fn say(line: &str) {
    let is_aside = ASIDE.with_borrow_mut(|aside| {
        let file = aside.as_mut();
        file.map(|file| writeln!(file, "{line}"))
    });
    if is_aside.is_none() {
        eprintln!("{line}");
    }
}

/// The command as a person would type it, with the variables that are set for it.
pub fn display(command: &Command) -> String {
    let variables = command
        .get_envs()
        .filter_map(|(name, value)| Some((name, value?)))
        .map(|(name, value)| format!("{}={}", name.display(), quote(&value.to_string_lossy())));
    let words = std::iter::once(program(command))
        .chain(command.get_args())
        .map(|word| quote(&word.to_string_lossy()));
    variables.chain(words).collect::<Vec<_>>().join(" ")
}

/// The program's name; short for the cargo that runs this program.
fn program(command: &Command) -> &OsStr {
    let program = command.get_program();
    let is_own_cargo = std::env::var_os("CARGO").is_some_and(|own| own == program);
    if is_own_cargo {
        OsStr::new("cargo")
    } else {
        program
    }
}

fn quote(word: &str) -> String {
    let plain = |c: char| c.is_ascii_alphanumeric() || "-_=+./:,@%~".contains(c);
    if !word.is_empty() && word.chars().all(plain) {
        word.to_owned()
    } else {
        format!("'{}'", word.replace('\'', r"'\''"))
    }
}

/// Shows the command on standard error, with the folder it runs in.
pub fn show(command: &Command) {
    match command.get_current_dir() {
        Some(folder) => say(&format!("+ (in {}) {}", folder.display(), display(command))),
        None => say(&format!("+ {}", display(command))),
    }
}

/// Shows and runs the command with this program's own input and output.
pub fn run(command: &mut Command) -> Result<()> {
    show(command);
    run_quietly(command)
}

/// Runs the command with this program's own input and output, without showing it.
pub fn run_quietly(command: &mut Command) -> Result<()> {
    command.stdout(printed()).stderr(printed());
    let status = command.status().with_context(|| cannot_start(command))?;
    check(status, command)
}

/// Runs the command quietly and gives its standard output.
pub fn output(command: &mut Command) -> Result<String> {
    let output = command
        .stderr(printed())
        .output()
        .with_context(|| cannot_start(command))?;
    check(output.status, command)?;
    String::from_utf8(output.stdout)
        .with_context(|| format!("`{}` printed something else than text", display(command)))
}

/// True when the command can be started and succeeds; its output is thrown away.
pub fn succeeds(command: &mut Command) -> bool {
    command
        .stdin(Stdio::null())
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .status()
        .is_ok_and(|status| status.success())
}

/// Shows and runs the command; hands every line of its standard output to `each`, together with its
/// end.
pub fn for_each_line(command: &mut Command, mut each: impl FnMut(&str)) -> Result<()> {
    show(command);
    let mut child = command
        .stdout(Stdio::piped())
        .stderr(printed())
        .spawn()
        .with_context(|| cannot_start(command))?;
    let stdout = child
        .stdout
        .take()
        .context("standard output is not piped")?;
    let read = read_lines(stdout, &mut each);
    let status = child
        .wait()
        .with_context(|| format!("waiting for `{}`", display(command)))?;
    read.with_context(|| format!("reading the output of `{}`", display(command)))?;
    check(status, command)
}

fn read_lines(stdout: impl io::Read, each: &mut impl FnMut(&str)) -> io::Result<()> {
    let mut reader = BufReader::new(stdout);
    let mut line = Vec::new();
    while reader.read_until(b'\n', &mut line)? > 0 {
        each(&String::from_utf8_lossy(&line));
        line.clear();
    }
    Ok(())
}

/// Prints text as it came, at once.
pub fn print_through(text: &str) {
    // A reader that went away must not end the run: the result is the exit code.
    let _ = ASIDE.with_borrow_mut(|aside| match aside {
        Some(file) => file.write_all(text.as_bytes()),
        None => {
            let mut stdout = io::stdout().lock();
            stdout
                .write_all(text.as_bytes())
                .and_then(|()| stdout.flush())
        }
    });
}

/// The first program of this name on `PATH`.
pub fn find_program(name: &str) -> Option<PathBuf> {
    let path = std::env::var_os("PATH")?;
    std::env::split_paths(&path)
        .map(|folder| folder.join(name))
        .find(|file| file.is_file())
}

fn check(status: ExitStatus, command: &Command) -> Result<()> {
    if !status.success() {
        bail!("`{}` failed ({status})", display(command));
    }
    Ok(())
}

fn cannot_start(command: &Command) -> String {
    format!("cannot start `{}`", display(command))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_command_is_shown_as_it_could_be_typed() {
        let mut command = Command::new("cargo");
        command
            .args(["test", "a b", "it's", ""])
            .env("KEY", "two words");
        assert_eq!(
            display(&command),
            r"KEY='two words' cargo test 'a b' 'it'\''s' ''"
        );
    }

    /// The thread's own lines, those of programs, and what is handed on.
    #[test]
    fn what_is_done_aside_prints_into_its_file() {
        let path = std::env::temp_dir().join(format!("aside-{}.txt", std::process::id()));
        aside(File::create(&path).unwrap(), || {
            say("one");
            run_quietly(Command::new("sh").args(["-c", "echo two; echo three >&2"])).unwrap();
            print_through("four\n");
        });
        let text = std::fs::read_to_string(&path).unwrap();
        std::fs::remove_file(&path).unwrap();
        assert_eq!(text, "one\ntwo\nthree\nfour\n");
    }

    #[test]
    fn a_failing_command_is_named_in_the_error() {
        let error = run(Command::new("sh").args(["-c", "exit 3"])).unwrap_err();
        assert!(error.to_string().contains("sh -c 'exit 3'"), "{error}");
        assert!(error.to_string().contains('3'), "{error}");
    }

    #[test]
    fn a_program_that_does_not_exist_is_named_in_the_error() {
        let error = run(&mut Command::new("/no/such/program")).unwrap_err();
        assert!(error.to_string().contains("/no/such/program"), "{error}");
    }

    #[test]
    fn every_line_is_handed_over_even_the_last_without_an_end() {
        let mut lines = Vec::new();
        let mut command = Command::new("printf");
        for_each_line(command.arg("one\\ntwo"), |line| {
            lines.push(line.to_owned());
        })
        .unwrap();
        assert_eq!(lines, ["one\n", "two"]);
    }
}
