//! How `armor` ends, as a number that scripts can rely on.

use std::process::ExitCode;

/// What a command came to. Wrong usage is 2 and ends in the command line's own parser.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CommandEnding {
    /// 0: all is fine; a mission reached its goal.
    Fine,
    /// 1: the check or the run failed.
    Failed,
    /// 3: `armor stop --all` has ended a run before its mission was over.
    Stopped,
    /// 130: interrupted.
    Interrupted,
}

impl CommandEnding {
    /// The number.
    pub fn code(self) -> u8 {
        match self {
            Self::Fine => 0,
            Self::Failed => 1,
            Self::Stopped => 3,
            Self::Interrupted => 130,
        }
    }
}

impl From<CommandEnding> for ExitCode {
    fn from(ending: CommandEnding) -> Self {
        Self::from(ending.code())
    }
}
