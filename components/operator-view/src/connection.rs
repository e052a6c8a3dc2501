//! What the screen is connected to: the system that it is a part of, or one that it watches, which
//! may not have been started, or may have ended.

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
    /// It has watched the system; what is shown is old.
    Lost {
        /// Its name.
        system: String,
        /// What has ended and why.
        why: String,
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
            Self::Lost { system, .. } => Err(format!("{system} has ended")),
        }
    }

    /// Returns whether what is shown is of the past.
    pub fn is_lost(&self) -> bool {
        matches!(self, Self::Lost { .. })
    }
}

/// Returns how a run has ended, from the lines of its launcher's log.
pub fn find_end(system: &str, log: &str) -> String {
    let own = format!("{system}: ");
    let said = log.lines().rev().find_map(|line| Some(line.split_once(&own)?.1));
    match said.filter(|text| !text.starts_with("registry ")) {
        Some("interrupted") => "it was interrupted (Ctrl-C, or a signal to its launcher)".into(),
        Some(verdict) => verdict.into(),
        None => "its launcher is gone: it was killed, or the host has restarted".into(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_launchers_log_has_the_reason_unless_the_launcher_was_killed() {
        let begin = "0.0 INFO launcher rover: registry 127.0.0.1:7411, output out/rover\n";
        let check = |rest: &str, expected: &str| {
            let found = find_end("rover", &format!("{begin}{rest}"));
            assert!(found.contains(expected), "{found}");
        };
        check("", "its launcher is gone");
        check("9.1 INFO launcher rover: the mission reached its goal\n", "the mission reached");
        check("9.1 INFO launcher rover: interrupted\n", "Ctrl-C");
        let given_up = "rover: arm failed for good, and the system needs it\n";
        check(given_up, "arm failed for good");
    }

    #[test]
    fn orders_reach_only_a_system_that_runs() {
        assert!(SystemConnection::Part.check_orders().is_ok());
        let lost = SystemConnection::Lost { system: "rover".into(), why: String::new() };
        assert_eq!(lost.check_orders(), Err("rover has ended".into()));
    }
}
