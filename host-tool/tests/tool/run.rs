//! Runs the tool as a user does.

use std::process::{Child, Command, Output, Stdio};
use std::sync::mpsc;
use std::time::Duration;

/// Longest time of any run of the tool.
const RUN_PATIENCE: Duration = Duration::from_secs(30);

/// A run of the tool.
pub struct Run(Child);

/// Starts `hivtac ARGUMENTS`.
pub fn start(arguments: &[&str]) -> Run {
    let mut command = Command::new(env!("CARGO_BIN_EXE_hivtac"));
    command
        .args(arguments)
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped());
    Run(command.spawn().unwrap())
}

/// Runs `hivtac ARGUMENTS` to its end.
pub fn run(arguments: &[&str]) -> Finished {
    start(arguments).finish()
}

/// Runs `hivtac ARGUMENTS` to its end, with this value of a variable of the environment.
pub fn run_with(variable: &str, value: &str, arguments: &[&str]) -> Finished {
    let mut tool = Command::new(env!("CARGO_BIN_EXE_hivtac"));
    Finished::new(tool.args(arguments).env(variable, value).output().unwrap())
}

/// Runs `hivtac` to its end with `words` of the shell, on a disk that is full once a file has this
/// many blocks of 512 bytes.
pub fn run_on_full_disk(blocks: u32, words: &str) -> Finished {
    let program = env!("CARGO_BIN_EXE_hivtac");
    let script = format!("trap '' XFSZ; ulimit -f {blocks}; exec {program} {words}");
    let output = Command::new("sh").args(["-c", &script]).output();
    Finished::new(output.unwrap())
}

impl Run {
    pub fn child(&mut self) -> &mut Child {
        &mut self.0
    }

    /// Waits for its end.
    pub fn finish(self) -> Finished {
        let pid = self.0.id();
        let (sender, receiver) = mpsc::channel();
        std::thread::spawn(move || sender.send(self.0.wait_with_output().unwrap()));
        match receiver.recv_timeout(RUN_PATIENCE) {
            Ok(output) => Finished::new(output),
            Err(_) => {
                signal(pid, "KILL");
                panic!("the tool did not end within {RUN_PATIENCE:?}");
            }
        }
    }
}

/// Sends a signal to a process.
pub fn signal(pid: u32, name: &str) {
    let status = Command::new("kill")
        .args(["-s", name, &pid.to_string()])
        .status();
    assert!(status.unwrap().success());
}

/// The exit code and output of a run.
#[derive(Debug)]
pub struct Finished {
    pub code: Option<i32>,
    pub stdout: String,
    pub stderr: String,
}

impl Finished {
    fn new(output: Output) -> Finished {
        Finished {
            code: output.status.code(),
            stdout: String::from_utf8(output.stdout).unwrap(),
            stderr: String::from_utf8(output.stderr).unwrap(),
        }
    }
}

/// The sequence numbers of JSON lines.
pub fn sequence_numbers(stdout: &str) -> Vec<u64> {
    let lines = stdout
        .lines()
        .map(|line| serde_json::from_str::<serde_json::Value>(line).unwrap());
    lines.map(|line| line["seq"].as_u64().unwrap()).collect()
}
