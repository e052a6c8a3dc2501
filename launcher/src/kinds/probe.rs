//! Asks one executable to describe itself. It is a stranger: limited in time and in output, killed
//! with everything it started.

use std::borrow::Cow;
use std::io::{self, ErrorKind, Read};
use std::os::unix::process::CommandExt;
use std::path::Path;
use std::process::{Child, Command, ExitStatus, Stdio};
use std::sync::mpsc::{self, Receiver};
use std::thread;
use std::time::{Duration, Instant};

use armor_robotfile::{Code, Finding};
use armor_wire::manifest::{MANIFEST_VERSION, Manifest};
use armor_wire::version::VERSION;
use rustix::io::Errno;
use rustix::process::{Pid, Signal, kill_process_group};
use serde::Deserialize;

use super::script::{find_exception_place, find_missing_part};

/// How long a description may take: Python with its libraries from a cold disk takes seconds.
const WITHIN: Duration = Duration::from_secs(5);
/// Longest description in bytes.
const MAX_LEN: u64 = 1 << 20;
/// What is kept of the complaints of one that fails, in bytes.
const MAX_COMPLAINT_LEN: u64 = 4 << 10;
/// Longest wait for the rest of stderr after its end. The text is already in the pipe; only the
/// thread that reads it may be late.
const COMPLAINT_WITHIN: Duration = Duration::from_secs(2);
/// Period of the check on an executable that runs, or that is still being written.
const LOOK: Duration = Duration::from_millis(2);

/// Why an executable cannot be used.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ProbeProblem {
    code: Code,
    message: String,
    remedy: Cow<'static, str>,
}

impl ProbeProblem {
    /// Returns the finding about the executable at `path`.
    pub fn finding(&self, path: &Path) -> Finding {
        let message = format!("{}: {}; it is not used", path.display(), self.message);
        Finding::nowhere(self.code, message).remedy(&*self.remedy)
    }
}

impl ProbeProblem {
    /// Asking it panicked, or was never begun.
    pub fn unasked() -> Self {
        no_manifest("it could not be asked")
    }

    /// It did not answer in time.
    pub fn hangs() -> Self {
        Self {
            code: Code::DescribeHangs,
            message: format!("--describe did not end within {} s", WITHIN.as_secs()),
            remedy: "nothing may happen before --describe is answered: no hardware, no network; \
                     touch it to have it asked again"
                .into(),
        }
    }

    /// Its kind of finding.
    pub fn code(&self) -> Code {
        self.code
    }
}

fn no_manifest(message: impl Into<String>) -> ProbeProblem {
    let remedy = "run it with --describe; it must print its manifest (docs/manifest.md) and end";
    ProbeProblem { code: Code::BrokenExecutable, message: message.into(), remedy: remedy.into() }
}

/// Asks the executable at `path` for its description.
///
/// # Errors
/// What is wrong with it, after [`WITHIN`] at the latest.
pub fn ask_description(path: &Path) -> Result<Manifest, ProbeProblem> {
    let deadline = Instant::now() + WITHIN;
    let mut child = start_executable(path, deadline).map_err(|error| cannot_start(path, &error))?;
    let answer = read_answer(path, &mut child, deadline);
    // It is over, or it hangs, or what it started does.
    if let Some(group) = i32::try_from(child.id()).ok().and_then(Pid::from_raw) {
        let _ = kill_process_group(group, Signal::KILL);
    }
    let _ = child.kill();
    let _ = child.wait();
    parse_manifest(&answer?)
}

/// Starts it; waits while another process still writes it.
fn start_executable(path: &Path, deadline: Instant) -> io::Result<Child> {
    loop {
        let started = Command::new(path)
            .arg("--describe")
            .stdin(Stdio::null())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .process_group(0)
            .spawn();
        match started {
            Err(error)
                if error.kind() == ErrorKind::ExecutableFileBusy && Instant::now() < deadline =>
            {
                thread::sleep(LOOK);
            }
            started => return started,
        }
    }
}

/// Something else than a manifest on stdout, where only the manifest may be.
fn foreign_output(line: &str, place: &str) -> ProbeProblem {
    ProbeProblem {
        code: Code::BrokenExecutable,
        message: format!("--describe printed more than its manifest: {line:?} {place} it"),
        remedy: "only the manifest may be on stdout: its constructor too must write to stderr \
                 (eprintln!, tracing)"
            .into(),
    }
}

fn knows_no_describe(message: String) -> ProbeProblem {
    let remedy = "it seems to be no component: a component answers --describe with its manifest \
                  (docs/manifest.md); the SDK does this";
    ProbeProblem { code: Code::BrokenExecutable, message, remedy: remedy.into() }
}

fn cannot_start(path: &Path, error: &io::Error) -> ProbeProblem {
    if error.raw_os_error() == Some(Errno::NOEXEC.raw_os_error()) {
        return ProbeProblem {
            code: Code::NotAProgram,
            message: "it is marked executable, but is no program of this machine".into(),
            remedy: "chmod -x if it is none; a script begins with #! and what runs it; a program \
                     must be built for this machine"
                .into(),
        };
    }
    if error.kind() == ErrorKind::NotFound && path.exists() {
        let message = "it cannot be started: what would run it (its #! line or loader) is missing";
        return no_manifest(message);
    }
    no_manifest(format!("it cannot be started: {error}"))
}

fn read_answer(path: &Path, child: &mut Child, deadline: Instant) -> Result<Vec<u8>, ProbeProblem> {
    let (Some(stdout), Some(stderr)) = (child.stdout.take(), child.stderr.take()) else {
        return Err(no_manifest("it has no output"));
    };
    let (printed, complaint) =
        (read_in_background(stdout, MAX_LEN + 1), read_in_background(stderr, MAX_COMPLAINT_LEN));
    let late = ProbeProblem::hangs;
    let left = |deadline: Instant| deadline.saturating_duration_since(Instant::now());
    let bytes = printed.recv_timeout(left(deadline)).map_err(|_| late())?;
    let bytes = bytes.map_err(|error| no_manifest(format!("its output is lost: {error}")))?;
    if bytes.len() as u64 > MAX_LEN {
        return Err(no_manifest("--describe printed more than 1 MiB"));
    }
    let status = check_exit(child, deadline).ok_or_else(late)?;
    if status.success() {
        return Ok(bytes);
    }
    let how = status.code().map_or("a signal".into(), |code| format!("code {code}"));
    // What it started may keep its stderr open for ever.
    let complaint = complaint.recv_timeout(COMPLAINT_WITHIN).ok().and_then(Result::ok);
    let complaint = complaint.unwrap_or_default();
    if let Some(line) = find_usage(&complaint).or_else(|| find_usage(&bytes)) {
        let message = format!("it does not know --describe, and ended with {how}: {line:?}");
        return Err(knows_no_describe(message));
    }
    let last_words = find_last_words(&complaint);
    if let Some(part) = find_missing_part(&last_words) {
        return Err(ProbeProblem {
            code: Code::BrokenExecutable,
            message: format!("--describe ended with {how}: {}", part.describe(path)),
            remedy: part.propose_install(path).into(),
        });
    }
    let place = find_exception_place(&complaint, path);
    let place = place.map(|place| shown_line(&place) + ": ").unwrap_or_default();
    let last_words = Some(place + &last_words).filter(|line| !line.is_empty());
    let last_words = last_words.map(|line| format!(": {line}")).unwrap_or_default();
    Err(no_manifest(format!("--describe ended with {how}{last_words}")))
}

/// Reads in the background: the other end may be kept open for ever.
fn read_in_background(
    from: impl Read + Send + 'static,
    limit: u64,
) -> Receiver<io::Result<Vec<u8>>> {
    let (sender, receiver) = mpsc::channel();
    thread::spawn(move || {
        let mut bytes = Vec::new();
        let read = from.take(limit).read_to_end(&mut bytes);
        let _ = sender.send(read.map(|_| bytes));
    });
    receiver
}

/// Returns the first panic of Rust, place and message; if there is none, the last line: there
/// Python names its exception, and a shell the missing program.
fn find_last_words(bytes: &[u8]) -> String {
    let text = String::from_utf8_lossy(bytes);
    let lines = || text.lines().map(str::trim).filter(|line| !line.is_empty());
    let begins_panic = |line: &&str| line.starts_with("thread '") && line.contains(" panicked at ");
    let is_note = |line: &&str| line.starts_with("note:");
    let ends_panic = |line: &&str| is_note(line) || *line == "stack backtrace:";
    let panic: Vec<&str> = lines()
        .skip_while(|line| !begins_panic(line))
        .take_while(|line| !ends_panic(line))
        .collect();
    if !panic.is_empty() {
        return shown_line(&panic.join(" "));
    }
    let last = lines().rev().find(|line| !is_note(line)).or_else(|| lines().next_back());
    shown_line(last.unwrap_or_default())
}

/// Returns a line of foreign output without control characters, and not too much of it.
fn shown_line(line: &str) -> String {
    line.trim().chars().filter(|c| !c.is_control()).take(200).collect()
}

/// Returns the line by which a program rejects `--describe`, or with which its usage begins.
fn find_usage(bytes: &[u8]) -> Option<String> {
    let text = String::from_utf8_lossy(bytes);
    let rejects = |line: &&str| {
        line.contains("--describe")
            && ["unexpected", "unknown", "unrecogni", "invalid", "illegal", "no such option"]
                .iter()
                .any(|word| line.to_lowercase().contains(word))
    };
    let begins_usage = |line: &&str| line.trim_start().to_lowercase().starts_with("usage");
    let line = text.lines().find(rejects).or_else(|| text.lines().find(begins_usage))?;
    Some(shown_line(line))
}

fn check_exit(child: &mut Child, deadline: Instant) -> Option<ExitStatus> {
    loop {
        if let Some(status) = child.try_wait().ok()? {
            return Some(status);
        }
        if Instant::now() >= deadline {
            return None;
        }
        thread::sleep(LOOK);
    }
}

/// What every version has.
#[derive(Deserialize)]
struct ManifestVersions {
    armor_manifest: u32,
    #[serde(default)]
    protocol: Option<u16>,
}

impl ManifestVersions {
    /// # Errors
    /// If the component was built for another release than this one.
    fn compare(&self) -> Result<(), ProbeProblem> {
        let protocol = self.protocol.unwrap_or(VERSION);
        let (form, known) = (self.armor_manifest, MANIFEST_VERSION);
        let (message, is_newer) = if form != known {
            (format!("its manifest is of version {form}, not {known}"), form > known)
        } else if protocol != VERSION {
            let message = format!("it speaks version {protocol} of the protocol, not {VERSION}");
            (message, protocol > VERSION)
        } else {
            return Ok(());
        };
        let remedy = if is_newer {
            "it was built for a newer Armor: update this one"
        } else {
            "rebuild it with this version's SDK"
        };
        Err(ProbeProblem { code: Code::ManifestVersion, message, remedy: remedy.into() })
    }
}

fn parse_manifest(bytes: &[u8]) -> Result<Manifest, ProbeProblem> {
    let text = std::str::from_utf8(bytes)
        .map_err(|_| no_manifest("--describe printed something that is not UTF-8"))?;
    if text.trim().is_empty() {
        return Err(no_manifest(
            "--describe printed nothing, and no error: it ended before it printed its manifest. A \
             constructor (`new`) returns and does not end the process",
        ));
    }
    if let Some(problem) = find_foreign_output(text) {
        return Err(problem);
    }
    let first = text.lines().find(|line| !line.trim().is_empty()).unwrap_or_default();
    let wrong = |error: serde_json::Error| {
        let printed = if first.trim_start().starts_with('{') {
            "a manifest that cannot be read".into()
        } else {
            format!("{:?}, which is no manifest", shown_line(first))
        };
        no_manifest(format!("--describe printed {printed}: {error}"))
    };
    let versions: ManifestVersions = serde_json::from_str(text).map_err(wrong)?;
    versions.compare()?;
    let manifest: Manifest = serde_json::from_str(text).map_err(wrong)?;
    manifest.validate().map_err(|why| no_manifest(format!("its manifest is wrong: {why}")))?;
    Ok(manifest)
}

/// Finds what is printed before or after a manifest, or in place of one.
fn find_foreign_output(text: &str) -> Option<ProbeProblem> {
    let is_manifest = |value: &serde_json::Value| value.get("armor_manifest").is_some();
    let mut start = 0;
    for line in text.split_inclusive('\n') {
        if line.trim_start().starts_with('{') {
            let mut values =
                serde_json::Deserializer::from_str(&text[start..]).into_iter::<serde_json::Value>();
            if values.next().and_then(Result::ok).is_some_and(|value| is_manifest(&value)) {
                let end = start + values.byte_offset();
                let foreign =
                    |part: &str| part.lines().map(shown_line).find(|line| !line.is_empty());
                let before = foreign(&text[..start]).map(|line| foreign_output(&line, "is before"));
                let after = || foreign(&text[end..]).map(|line| foreign_output(&line, "is after"));
                return before.or_else(after);
            }
        }
        start += line.len();
    }
    let line = find_usage(text.as_bytes())?;
    Some(knows_no_describe(format!("--describe printed its usage and no manifest: {line:?}")))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_panic_is_shown_by_its_own_lines() {
        let panic = "thread 'main' panicked at src/main.rs:12:5:";
        let shown = "thread 'main' panicked at src/main.rs:12:5: no port";
        let hint = "note: run with `RUST_BACKTRACE=1` environment variable to display a backtrace";
        let omitted = "note: Some details are omitted, run with `RUST_BACKTRACE=full`";
        for (text, expected) in [
            (format!("opening\n\n{panic}\nno port\n{hint}\n"), shown),
            (format!("{panic}\nno port\nstack backtrace:\n   0: start\n{omitted}\n"), shown),
            (format!("{panic}\nno port\n{hint}\nthread 'b' panicked at b.rs:1:1:\nx"), shown),
            (format!("{panic}\nno port\n"), shown),
            ("Traceback:\n  a\nKeyError: 'x'\n".into(), "KeyError: 'x'"),
            (format!("error: no port\n{hint}\n"), "error: no port"),
            ("note: a\nnote: b\n".into(), "note: b"),
            (String::new(), ""),
        ] {
            assert_eq!(find_last_words(text.as_bytes()), expected, "{text}");
        }
    }
}
