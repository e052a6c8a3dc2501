//! The list of what is measured, job by job, in the order of the table.

pub const KIB: usize = 1 << 10;
pub const MIB: usize = 1 << 20;
/// A small message; the size of a pose.
pub const SMALL_LEN: usize = 100;

/// Messages whose age is measured: a pose to a picture of a camera.
const FRESHNESS_LENS: [usize; 5] = [1000, 60_000, 300_000, MIB, 8 * MIB];

/// What is measured together.
#[derive(Clone, Copy, Debug)]
pub enum BenchJob {
    /// Ping and answer, one at a time; both ends sleep or spin meanwhile.
    RoundTrip { len: usize, spin: bool },
    /// Small messages to one subscriber, as fast as it takes them, none lost.
    Flood,
    /// Large messages to several subscribers, as fast as they take them, none lost.
    FanOut { subscribers: usize },
    /// Small messages to one subscriber at 10 kHz.
    Paced,
    /// From the start of a process to the first message it receives.
    First,
    /// Memory and threads of an idle process.
    Idle,
    /// A large file read and checked.
    Check,
    /// From a component's report to the activation of the next one; with the journal on the disk,
    /// or in memory.
    Reaction { on_disk: bool },
    /// The age of data at a subscriber that is slower than its publisher: always, or now and then;
    /// over a Unix socket, or TCP. Takes minutes, so only `--only` measures it.
    Freshness { len: usize, always: bool, tcp: bool },
}

impl BenchJob {
    /// Everything there is to measure, in the order of the table.
    pub fn all() -> impl Iterator<Item = Self> {
        let lens = [50, SMALL_LEN, 1000, 64 * KIB, MIB, 8 * MIB];
        let round_trips = lens.map(|len| Self::RoundTrip { len, spin: false });
        let spinning = [SMALL_LEN, 64 * KIB].map(|len| Self::RoundTrip { len, spin: true });
        let fan_outs = [1, 4, 8].map(|subscribers| Self::FanOut { subscribers });
        let rest = [Self::Flood, Self::Paced];
        round_trips.into_iter().chain(spinning).chain(rest).chain(fan_outs).chain([
            Self::First,
            Self::Idle,
            Self::Check,
            Self::Reaction { on_disk: true },
            Self::Reaction { on_disk: false },
        ])
    }

    /// What is measured only if it is named.
    pub fn all_long() -> impl Iterator<Item = Self> {
        let ways = [(true, false), (false, false), (true, true), (false, true)];
        ways.into_iter().flat_map(|(always, tcp)| {
            FRESHNESS_LENS.map(|len| Self::Freshness { len, always, tcp })
        })
    }

    /// Its name for `--only`.
    pub fn part(self) -> &'static str {
        match self {
            Self::RoundTrip { spin: false, .. } => "lat",
            Self::RoundTrip { spin: true, .. } => "spin",
            Self::Flood => "flood",
            Self::FanOut { .. } => "fan",
            Self::Paced => "paced",
            Self::First => "first",
            Self::Idle => "idle",
            Self::Check => "check",
            Self::Reaction { .. } => "reaction",
            Self::Freshness { .. } => "freshness",
        }
    }
}

/// What is measured of a blackboard, apart from the other jobs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BlackboardJob {
    /// One writer at 1 kHz and 16 readers.
    Readers,
    /// Figure 7 of Little-MEC.
    FigureSeven,
    /// What a pull costs.
    Pull,
}

impl BlackboardJob {
    /// The job of this name for `--only`.
    pub fn from_part(part: &str) -> Option<Self> {
        match part {
            "blackboard" => Some(Self::Readers),
            "figure-seven" => Some(Self::FigureSeven),
            "pull" => Some(Self::Pull),
            _ => None,
        }
    }
}
