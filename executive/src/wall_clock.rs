//! The wall clock: UTC as this host has it, and whether a time service is known to keep it right.
//! The kernel knows, and reports it to `timedatectl`; where that is missing, chrony and
//! systemd-timesyncd are asked themselves.

use crate::event::ControllerEvent;
use armor_robotfile::Date;
use std::io::Read;
use std::path::Path;
use std::process::{Command, Stdio};
use std::sync::mpsc;
use std::time::{Duration, SystemTime, UNIX_EPOCH};

/// The smallest shift of the clock against mission time that matters to dates.
const MIN_SHIFT: Duration = Duration::from_millis(1);
/// How long a program may take to answer.
const ANSWER_WITHIN: Duration = Duration::from_secs(3);
/// How far off the clock may be by chrony's own bound, in seconds. Appointments are kept to the
/// second.
const MOST_OFF_S: f64 = 1.0;
/// How long a synchronisation by systemd-timesyncd is worth something: it asks its servers every
/// 34 minutes at least, and a clock left alone is off by at most 5 s after three hours (500 ppm).
const SYNCHRONISED_WITHIN: Duration = Duration::from_secs(3 * 3600);
/// Touched by systemd-timesyncd at each synchronisation.
const SYNCHRONISED: &str = "/run/systemd/timesync/synchronized";

/// What one time service reports about the clock.
#[derive(Clone, Debug, PartialEq, Eq)]
enum ClockOpinion {
    Kept,
    Doubt(String),
}

/// UTC now, by this host's clock, which may be set at any time.
pub fn utc() -> Date {
    Date::since_1970(SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default())
}

/// The wall clock against mission time. It may be set, and run at another speed; mission
/// time is not moved by that.
#[derive(Debug, Default)]
pub(crate) struct Calendar {
    sent: Option<Date>,
}

impl Calendar {
    /// Returns UTC at mission time 0, when it differs from the last one returned.
    pub(crate) fn news(&mut self, utc: Date, now: Duration) -> Option<ControllerEvent> {
        let at_start = utc.earlier(now);
        let moved = |sent: Date| sent.after(at_start).or(at_start.after(sent));
        if self.sent.and_then(moved).is_some_and(|by| by <= MIN_SHIFT) {
            return None;
        }
        self.sent = Some(at_start);
        Some(ControllerEvent::Utc { at_start })
    }
}

/// Returns why this host's clock may not be right; none if a time service is known to keep it.
pub fn doubts() -> Option<String> {
    let kernel =
        || match run_program("timedatectl", &["show", "--property=NTPSynchronized", "--value"]) {
            Ok(text) => read_timedatectl(&text),
            Err(why) => ClockOpinion::Doubt(why),
        };
    let chrony = || match run_program("chronyc", &["-c", "-n", "tracking"]) {
        Ok(text) => read_chrony(&text),
        Err(why) => ClockOpinion::Doubt(why),
    };
    let timesync = || judge_timesyncd(age(Path::new(SYNCHRONISED)));
    let mut doubts = Vec::new();
    for ask in [&kernel as &dyn Fn() -> ClockOpinion, &chrony, &timesync] {
        match ask() {
            ClockOpinion::Kept => return None,
            ClockOpinion::Doubt(why) => doubts.push(why),
        }
    }
    Some(doubts.join("; "))
}

/// Returns why a mission with dates does not begin by a clock with these doubts.
pub(crate) fn describe_doubts(doubts: &str) -> String {
    format!(
        "this mission has absolute dates, and the clock of this host is not known to be right \
         ({doubts}): let systemd-timesyncd, chrony or another time service keep it; or, if you know \
         that it is right, run with --trust-clock"
    )
}

/// `yes` or `no`: whether the kernel counts its clock as synchronised.
fn read_timedatectl(text: &str) -> ClockOpinion {
    match text.trim() {
        "yes" => ClockOpinion::Kept,
        "no" => {
            ClockOpinion::Doubt("the kernel reports that no service synchronises it".to_owned())
        }
        other => ClockOpinion::Doubt(format!("timedatectl answers {other:?}")),
    }
}

/// One line of comma-separated fields, of which the 11th and 12th are root delay and dispersion in
/// seconds, and the 14th whether it is synchronised.
fn read_chrony(text: &str) -> ClockOpinion {
    let fields: Vec<_> = text.trim().split(',').collect();
    let seconds = |index: usize| fields.get(index).and_then(|field| field.parse::<f64>().ok());
    match (seconds(10), seconds(11), fields.get(13)) {
        (_, _, Some(&"Not synchronised")) => {
            ClockOpinion::Doubt("chrony reports that it is not synchronised".to_owned())
        }
        (Some(delay_s), Some(dispersion_s), Some(_)) => {
            let off_s = delay_s / 2.0 + dispersion_s;
            if off_s <= MOST_OFF_S {
                return ClockOpinion::Kept;
            }
            ClockOpinion::Doubt(format!("chrony reports that it may be off by {off_s:.1} s"))
        }
        _ => ClockOpinion::Doubt("chronyc answers something else than expected".to_owned()),
    }
}

fn judge_timesyncd(since: Option<Duration>) -> ClockOpinion {
    match since {
        Some(since) if since <= SYNCHRONISED_WITHIN => ClockOpinion::Kept,
        Some(since) => ClockOpinion::Doubt(format!(
            "systemd-timesyncd synchronised it {} h ago and not since",
            since.as_secs() / 3600
        )),
        None => ClockOpinion::Doubt("systemd-timesyncd has not synchronised it".to_owned()),
    }
}

/// How long ago a file was touched; a moment that is still to come is as good as now.
fn age(path: &Path) -> Option<Duration> {
    let touched = std::fs::metadata(path).and_then(|file| file.modified()).ok()?;
    Some(SystemTime::now().duration_since(touched).unwrap_or_default())
}

/// What a program prints, if it is there and succeeds in time.
fn run_program(program: &str, arguments: &[&str]) -> Result<String, String> {
    let mut command = Command::new(program);
    command.args(arguments).env("LC_ALL", "C");
    command.stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::null());
    let mut child = command.spawn().map_err(|error| match error.kind() {
        std::io::ErrorKind::NotFound => format!("there is no {program}"),
        _ => format!("{program}: {error}"),
    })?;
    let (sender, output) = mpsc::channel();
    if let Some(mut stdout) = child.stdout.take() {
        let read = move || {
            let mut text = String::new();
            // The receiver is gone if it took too long.
            let _ = stdout.read_to_string(&mut text).map(|_| sender.send(text));
        };
        let reading = std::thread::Builder::new().name(program.into()).spawn(read);
        reading.map_err(|error| format!("{program}: {error}"))?;
    }
    let text = output.recv_timeout(ANSWER_WITHIN);
    if text.is_err() {
        // It may have ended by itself meanwhile.
        let _ = child.kill();
    }
    let status = child.wait().map_err(|error| format!("{program}: {error}"))?;
    match text {
        Ok(text) if status.success() => Ok(text),
        _ => Err(format!("{program} does not answer")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_they_say_is_understood() {
        assert_eq!(read_timedatectl("yes\n"), ClockOpinion::Kept);
        let doubt = |word: ClockOpinion| match word {
            ClockOpinion::Doubt(why) => why,
            ClockOpinion::Kept => panic!("no doubt"),
        };
        assert!(doubt(read_timedatectl("no\n")).contains("no service"));
        assert!(doubt(read_timedatectl("")).contains("\"\""));
        let tracking = |delay: &str, leap: &str| {
            format!(
                "C0000201,192.0.2.1,3,1795270000.1,0.0001,0.0002,0.0003,-5.1,0.0,0.1,{delay},0.002,64.3,{leap}\n"
            )
        };
        assert_eq!(read_chrony(&tracking("0.03", "Normal")), ClockOpinion::Kept);
        assert!(doubt(read_chrony(&tracking("0.03", "Not synchronised"))).contains("not"));
        assert!(doubt(read_chrony(&tracking("9", "Normal"))).contains("4.5 s"));
        assert!(doubt(read_chrony("506 Cannot talk to daemon")).contains("expected"));
        assert_eq!(judge_timesyncd(Some(Duration::from_secs(60))), ClockOpinion::Kept);
        assert!(doubt(judge_timesyncd(Some(Duration::from_secs(36_000)))).contains("10 h"));
        assert!(doubt(judge_timesyncd(None)).contains("has not"));
    }

    #[test]
    fn who_does_not_answer_is_a_doubt() {
        assert_eq!(run_program("sh", &["-c", "echo yes"]), Ok("yes\n".to_owned()));
        assert!(run_program("sh", &["-c", "exit 1"]).is_err_and(|why| why.contains("sh does not")));
        assert!(
            run_program("sh", &["-c", "exec sleep 600"]).is_err_and(|why| why.contains("sh does"))
        );
        assert!(run_program("no-such-program", &[]).is_err_and(|why| why.contains("there is no")));
    }
}
