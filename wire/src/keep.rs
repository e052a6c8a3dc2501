//! Which data a subscriber gets when it is slower than its publisher, and how a link's ends wait.

use std::fmt;
use std::str::FromStr;

use serde::{Serialize, Serializer};

use crate::Message;

/// Largest `keep="n"`.
pub const MAX_KEEP: u32 = 65_536;

/// Between `all` and its patience, in the text of a status.
const PATIENCE: &str = ", patience ";

/// Which data a slow subscriber gets.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Message)]
#[message(wire = "armor_wire")]
pub enum Keep {
    /// Only the newest; older ones that wait are dropped and counted.
    #[default]
    Latest,
    /// The newest `count`; the oldest is dropped and counted.
    Last {
        /// Most data that wait.
        count: u32,
    },
    /// Everything; the sender waits.
    All {
        /// How long it waits for a subscriber that takes nothing, in milliseconds; then it ends the
        /// link.
        patience_ms: u32,
    },
    /// Only the newest, and only when the subscriber asks for it
    /// ([`FrameKind::Sync`](crate::frame::FrameKind::Sync)).
    Pull,
}

/// How the two ends of a link wait for each other.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Message)]
#[message(wire = "armor_wire")]
pub enum Wake {
    /// They sleep in the kernel.
    #[default]
    Sleep,
    /// They poll: a tenth of the latency for a whole core.
    Spin,
}

impl Keep {
    /// Everything, with the patience of a link that states none.
    pub const ALL: Self = Self::All { patience_ms: 10_000 };

    /// Whether nothing is dropped.
    pub fn is_all(self) -> bool {
        matches!(self, Self::All { .. })
    }

    /// Whether a link may be asked for this: the count of `Last` is within 1 and [`MAX_KEEP`].
    pub fn is_allowed(self) -> bool {
        !matches!(self, Self::Last { count } if !(1..=MAX_KEEP).contains(&count))
    }
}

impl FromStr for Keep {
    type Err = String;
    fn from_str(text: &str) -> Result<Self, String> {
        match text {
            "latest" => Ok(Self::Latest),
            "all" => Ok(Self::ALL),
            "pull" => Ok(Self::Pull),
            text if text.starts_with("all,") => text
                .strip_prefix("all")
                .and_then(|text| text.strip_prefix(PATIENCE)?.strip_suffix("ms")?.parse().ok())
                .map(|patience_ms| Self::All { patience_ms })
                .ok_or_else(|| format!("`{text}` has no patience")),
            number => number
                .parse()
                .ok()
                .map(|count| Self::Last { count })
                .filter(|keep| keep.is_allowed())
                .ok_or_else(|| format!("keep is latest, all, or a number from 1 to {MAX_KEEP}")),
        }
    }
}

impl fmt::Display for Keep {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Latest => f.write_str("latest"),
            Self::Last { count } => write!(f, "{count}"),
            Self::All { patience_ms } if *self != Self::ALL => {
                write!(f, "all{PATIENCE}{patience_ms}ms")
            }
            Self::All { .. } => f.write_str("all"),
            Self::Pull => f.write_str("pull"),
        }
    }
}

impl Serialize for Keep {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_str(self)
    }
}

impl FromStr for Wake {
    type Err = String;
    fn from_str(text: &str) -> Result<Self, String> {
        match text {
            "sleep" => Ok(Self::Sleep),
            "spin" => Ok(Self::Spin),
            _ => Err("wake is sleep or spin".into()),
        }
    }
}

impl fmt::Display for Wake {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Sleep => "sleep",
            Self::Spin => "spin",
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn keep_and_wake_are_written_as_they_are_read() {
        for text in ["latest", "all", "all, patience 200ms", "pull", "1", "50", "65536"] {
            assert_eq!(text.parse::<Keep>().map(|keep| keep.to_string()), Ok(text.into()));
        }
        for text in ["", "0", "-1", "65537", "Latest", "1.5", "all, 2ms", "all, patience -1ms"] {
            assert!(text.parse::<Keep>().is_err(), "{text}");
        }
        for text in ["sleep", "spin"] {
            assert_eq!(text.parse::<Wake>().map(|wake| wake.to_string()), Ok(text.into()));
        }
        assert!("poll".parse::<Wake>().is_err());
    }
}
