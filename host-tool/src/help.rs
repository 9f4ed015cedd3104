//! The tool's help: exit codes, completions for shells, and man pages.

use crate::output::{note, print};
use clap::{Args, Command};
use clap_complete::Shell;
use hivtac_host::failure::{Failure, Kind};
use std::path::PathBuf;

/// Print a shell's completions of this tool's commands
///
/// Example: hivtac completion bash
#[derive(Args)]
pub struct CompletionArguments {
    /// Which shell's
    shell: Shell,
}

/// Write a man page of each command into a folder
///
/// Example: hivtac man ~/.local/share/man/man1
#[derive(Args)]
pub struct ManArguments {
    /// The folder, made when it is missing
    folder: PathBuf,
}

/// Adds the exit codes to the help of each command.
pub fn with_help(command: Command) -> Command {
    let codes = exit_codes();
    with_exit_codes(command, &codes).after_help(codes)
}

fn with_exit_codes(command: Command, codes: &str) -> Command {
    let names: Vec<String> = command
        .get_subcommands()
        .map(|it| it.get_name().to_owned())
        .collect();
    let command = command.after_long_help(codes.to_owned());
    names.into_iter().fold(command, |command, name| {
        command.mut_subcommand(name, |it| with_exit_codes(it, codes))
    })
}

/// Each exit code with its meaning, lowest first.
fn exit_codes() -> String {
    let done = "done; also when the reader of the output went away (broken pipe)".to_owned();
    let mut codes = vec![(0, done)];
    codes.extend(Kind::ALL.map(|kind| (kind.exit_code(), kind.meaning().to_owned())));
    codes.sort_unstable();
    let lines = codes
        .iter()
        .map(|(code, meaning)| format!("\n  {code:<4} {meaning}"));
    format!("Exit codes:{}", lines.collect::<String>())
}

/// Prints the completion script for a shell.
pub fn completion(arguments: &CompletionArguments, mut command: Command) -> Result<(), Failure> {
    let mut script = Vec::new();
    clap_complete::generate(arguments.shell, &mut command, "hivtac", &mut script);
    let script = String::from_utf8_lossy(&script);
    print(script.trim_end()).map(|_| ())
}

/// Writes a man page of each command into a folder, which is made if it is missing.
pub fn man(arguments: &ManArguments, command: Command) -> Result<(), Failure> {
    let folder = &arguments.folder;
    let failed = |error| {
        let folder = folder.display();
        Failure::input(format!("cannot write man pages into {folder}: {error}"))
    };
    std::fs::create_dir_all(folder).map_err(failed)?;
    clap_mangen::generate_to(command, folder).map_err(failed)?;
    let folder = folder.display();
    note(&format!(
        "man pages written; `man {folder}/hivtac.1` shows the first"
    ));
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::command;
    use std::path::Path;

    /// Commands that write files or a script, and print nothing for a program.
    const SILENT: [&str; 2] = ["hivtac completion", "hivtac man"];

    /// Every command that has no subcommands, with its full name.
    fn doing() -> Vec<(String, Command)> {
        let mut all = Vec::new();
        let mut left = vec![(String::from("hivtac"), command())];
        while let Some((name, command)) = left.pop() {
            let parts = command.get_subcommands();
            left.extend(parts.map(|it| (format!("{name} {}", it.get_name()), it.clone())));
            if !command.is_subcommand_required_set() {
                all.push((name, command));
            }
        }
        assert!(all.len() > 15, "{all:?}");
        all
    }

    /// The example in a command's long help.
    fn example(command: &Command) -> Option<String> {
        let text = command.get_long_about()?.to_string();
        let line = text.lines().find_map(|line| line.strip_prefix("Example: "));
        line.map(str::to_owned)
    }

    #[test]
    fn every_command_has_an_example_that_is_right_usage() {
        for (name, command) in doing() {
            let example = example(&command).unwrap_or_else(|| panic!("{name} has no example"));
            let is_its = example
                .strip_prefix(&name)
                .is_some_and(|rest| rest.is_empty() || rest.starts_with(' '));
            assert!(is_its, "{name}: {example}");
            let parsed = crate::command().try_get_matches_from(example.split(' '));
            let error = parsed.err().map(|error| error.to_string());
            assert_eq!(error, None, "{example}");
        }
    }

    #[test]
    fn every_command_that_says_something_can_say_it_to_a_program() {
        for (name, command) in doing() {
            let has_json = command
                .get_arguments()
                .any(|it| it.get_long() == Some("json"));
            let is_silent = SILENT.contains(&name.as_str());
            assert_ne!(has_json, is_silent, "{name}: --json");
        }
    }

    /// With its output, in a block of its own or after another command.
    #[test]
    fn every_command_is_shown_in_the_guide() {
        let root = Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap();
        let guide = std::fs::read_to_string(root.join("docs/using.md")).unwrap();
        for (name, _) in doing() {
            let begin = format!("$ {name}");
            let is_it = |line: &&str| {
                let rest = line.strip_prefix(begin.as_str());
                rest.is_some_and(|rest| rest.is_empty() || rest.starts_with(' '))
            };
            let mut after = guide.lines().skip_while(|line| !is_it(line)).skip(1);
            let output = after.next().unwrap_or_default();
            assert!(!output.is_empty(), "docs/using.md does not show {begin}");
        }
    }

    #[test]
    fn every_help_has_all_exit_codes() {
        for (name, mut command) in doing() {
            let help = command.render_long_help().to_string();
            for kind in Kind::ALL {
                let line = format!("  {:<4} {}", kind.exit_code(), kind.meaning());
                assert!(help.contains(&line), "{name} lacks {line}");
            }
        }
    }

    #[test]
    fn each_command_has_its_man_page_with_example_and_exit_codes() {
        let folder = tempfile::tempdir().unwrap();
        let into = |folder: &Path| ManArguments {
            folder: folder.to_owned(),
        };
        man(&into(folder.path()), command()).unwrap();
        for (name, _) in doing() {
            let file = name.replace(' ', "-") + ".1";
            let page = std::fs::read_to_string(folder.path().join(&file));
            let page = page.unwrap_or_else(|error| panic!("{file}: {error}"));
            for words in ["Example: hivtac", "Exit codes:"] {
                assert!(page.contains(words), "{file} lacks {words}");
            }
        }
        let blocked = folder.path().join("hivtac.1").join("below");
        let error = man(&into(&blocked), command()).unwrap_err().to_string();
        assert!(error.starts_with("cannot write man pages into"), "{error}");
    }
}
