//! Asks executables to describe themselves. They are strangers: limited in time and in output,
//! killed with everything they started.

use std::io::Read;
use std::os::unix::process::CommandExt;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, ExitStatus, Stdio};
use std::sync::mpsc;
use std::thread;
use std::time::{Duration, Instant};

use armor_wire::manifest::{MANIFEST_VERSION, Manifest};
use armor_wire::name::is_name;
use rustix::process::{Pid, Signal, kill_process_group};

/// How long a description may take.
const WITHIN: Duration = Duration::from_secs(3);
/// Longest description in bytes.
const MAX_LEN: u64 = 1 << 20;
/// Executables asked at once.
const AT_ONCE: usize = 16;

/// The manifest of each executable, or what is wrong with it, in the same order.
pub fn all(executables: &[PathBuf]) -> Vec<(PathBuf, Result<Manifest, String>)> {
    let mut answers = Vec::new();
    for some in executables.chunks(AT_ONCE) {
        thread::scope(|scope| {
            let asked: Vec<_> = some.iter().map(|path| scope.spawn(|| describe(path))).collect();
            for (path, answer) in some.iter().zip(asked) {
                let answer = answer.join().unwrap_or_else(|_| Err("asking it panicked".into()));
                answers.push((path.clone(), answer));
            }
        });
    }
    answers
}

fn describe(path: &Path) -> Result<Manifest, String> {
    let mut child = Command::new(path)
        .arg("--describe")
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        .stderr(Stdio::null())
        .process_group(0)
        .spawn()
        .map_err(|error| format!("it cannot be started: {error}"))?;
    let answer = answer(&mut child);
    // It is over, or it hangs, or what it started does.
    if let Some(group) = i32::try_from(child.id()).ok().and_then(Pid::from_raw) {
        let _ = kill_process_group(group, Signal::KILL);
    }
    let _ = child.kill();
    let _ = child.wait();
    parse(&answer?)
}

fn answer(child: &mut Child) -> Result<Vec<u8>, String> {
    let deadline = Instant::now() + WITHIN;
    let stdout = child.stdout.take().ok_or("it has no output")?;
    let (sender, receiver) = mpsc::channel();
    thread::spawn(move || {
        let mut bytes = Vec::new();
        let read = stdout.take(MAX_LEN + 1).read_to_end(&mut bytes);
        let _ = sender.send(read.map(|_| bytes));
    });
    let late = || format!("--describe did not end within {} s", WITHIN.as_secs());
    let bytes = receiver.recv_timeout(WITHIN).map_err(|_| late())?.map_err(|e| e.to_string())?;
    if bytes.len() as u64 > MAX_LEN {
        return Err("--describe printed more than 1 MiB".into());
    }
    let status = ended(child, deadline).ok_or_else(late)?;
    if !status.success() {
        let how = status.code().map_or("a signal".into(), |code| format!("code {code}"));
        return Err(format!("--describe ended with {how}"));
    }
    Ok(bytes)
}

fn ended(child: &mut Child, deadline: Instant) -> Option<ExitStatus> {
    while Instant::now() < deadline {
        if let Some(status) = child.try_wait().ok()? {
            return Some(status);
        }
        thread::sleep(Duration::from_millis(2));
    }
    None
}

fn parse(bytes: &[u8]) -> Result<Manifest, String> {
    let manifest: Manifest = serde_json::from_slice(bytes)
        .map_err(|error| format!("--describe printed no manifest: {error}"))?;
    if manifest.armor_manifest != MANIFEST_VERSION {
        let version = manifest.armor_manifest;
        return Err(format!("its manifest is of version {version}, not {MANIFEST_VERSION}"));
    }
    if !is_name(&manifest.kind) {
        return Err(format!("its kind `{}` is not a name", manifest.kind));
    }
    Ok(manifest)
}
