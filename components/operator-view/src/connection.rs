//! What the screen is connected to: the system that it is a part of, or one that it watches, which
//! may not have been started, or may have ended.

/// What a lost connection is called.
pub const CUT: &str = "the connection to the robot's screen component is lost";

/// The connection of the screen to the system.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub enum SystemConnection {
    /// The screen is a part of the system.
    #[default]
    Part,
    /// It watches for a system, which has not been seen.
    Awaited {
        /// What is waited for, and what starts it.
        what: String,
    },
    /// It watches the system, which runs.
    Live {
        /// Its name.
        system: String,
    },
    /// Nothing comes from the system's screen component any more. The system may run.
    Cut {
        /// Its name.
        system: String,
        /// What is known of it, and what to do.
        why: String,
    },
    /// The mission is over, and so the screen component has ended; the launcher is still ending the
    /// others.
    Ending {
        /// Its name.
        system: String,
    },
    /// The system has ended, which its launcher's record proves; what is shown is old.
    Ended {
        /// Its name.
        system: String,
        /// Why.
        why: String,
        /// Whether it ended as it should, or as an operator ordered.
        is_normal: bool,
    },
}

impl SystemConnection {
    /// Returns whether orders can reach the robot; otherwise the reason.
    ///
    /// # Errors
    /// If they cannot, with the reason.
    pub fn check_orders(&self) -> Result<(), String> {
        match self {
            Self::Part | Self::Live { .. } => Ok(()),
            Self::Awaited { .. } => Err("no system runs yet".into()),
            Self::Cut { .. } => Err(CUT.into()),
            Self::Ending { system } => Err(format!("{system} is ending")),
            Self::Ended { system, .. } => Err(format!("{system} has ended")),
        }
    }

    /// Returns whether what is shown is of the past.
    pub fn is_old(&self) -> bool {
        self.is_cut() || self.has_ended()
    }

    /// Returns whether the connection is lost and the system may run.
    pub fn is_cut(&self) -> bool {
        matches!(self, Self::Cut { .. } | Self::Ending { .. })
    }

    /// Returns whether the system has ended.
    pub fn has_ended(&self) -> bool {
        matches!(self, Self::Ended { .. })
    }
}

/// How the launcher's verdicts begin or end; other lines of its log, such as the restart of a
/// component, are no end of the run.
const VERDICTS: [&str; 8] = [
    "the mission reached its goal",
    "the mission ended in its safe place",
    "the mission failed",
    "interrupted",
    "an operator has stopped it",
    "the time is over",
    "every component has ended",
    "failed for good, and the system needs it",
];

/// How a run has ended.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct RunEnd {
    /// Why.
    pub why: String,
    /// Whether it ended as it should, or as an operator ordered.
    pub is_normal: bool,
}

/// Returns how a run has ended, from the lines of its launcher's log since the last connection.
pub fn find_end(system: &str, log: &str) -> RunEnd {
    let own = format!(" {system}: ");
    let is_verdict = |text: &&str| VERDICTS.iter().any(|verdict| text.contains(verdict));
    let mut texts = log.lines().rev().filter_map(|line| Some(line.split_once(&own)?.1));
    let Some(verdict) = texts.find(is_verdict) else {
        let why = "its launcher is gone: it was killed, or the host has restarted".into();
        return RunEnd { why, is_normal: false };
    };
    let is_ordered = ["interrupted", "an operator has stopped it", "the time is over"];
    let is_normal = verdict == VERDICTS[0]
        || !verdict.contains("; failed: ") && is_ordered.iter().any(|it| verdict.starts_with(it));
    let why = match verdict {
        "interrupted" => "it was interrupted (Ctrl-C, or a signal to its launcher)".into(),
        verdict => verdict.into(),
    };
    RunEnd { why, is_normal }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_launchers_log_has_the_reason_unless_the_launcher_was_killed() {
        let begin = "0.0 INFO launcher rover: registry 127.0.0.1:7411, output out/rover\n";
        let check = |rest: &str, expected: &str| {
            let found = find_end("rover", &format!("{begin}{rest}"));
            assert!(found.why.contains(expected), "{found:?}");
            assert_eq!(found.is_normal, rest.contains("goal") || rest.contains("interrupted"));
        };
        check("", "its launcher is gone");
        check("9.1 INFO launcher rover: the mission reached its goal\n", "the mission reached");
        check("9.1 INFO launcher rover: interrupted\n", "Ctrl-C");
        let restarted = "9.1 INFO launcher an operator: view is restarted\n\
                         9.2 INFO launcher rover: view is restarted\n";
        check(restarted, "its launcher is gone");
        let given_up = "9.1 INFO launcher rover: arm failed for good, and the system needs it\n";
        check(given_up, "arm failed for good");
    }

    #[test]
    fn orders_reach_only_a_system_that_runs() {
        assert!(SystemConnection::Part.check_orders().is_ok());
        let (system, why) = ("rover".to_owned(), String::new());
        let cut = SystemConnection::Cut { system: system.clone(), why: why.clone() };
        assert!(cut.is_old() && !cut.has_ended());
        assert_eq!(cut.check_orders(), Err(CUT.into()), "it may run");
        let ended = SystemConnection::Ended { system, why, is_normal: true };
        assert_eq!(ended.check_orders(), Err("rover has ended".into()));
    }
}
