//! The typed model of a file, each piece with its location. Reading makes it as complete as the
//! text allows; [`crate::check`] checks its consistency.

use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::Arc;
use std::time::Duration;

use armor_wire::keep::{Keep, MAX_KEEP, Wake};
use armor_wire::remote_process::CutOff;
use armor_wire::text_format::FixedFrame;

use crate::mission::Mission;
use crate::overrides::OVERRIDE;
use crate::resources::ResourceLimits;
use crate::source::{Location, Source, Spanned};
use crate::unreadable::UnreadableParts;

/// A system, and the mission over it if there is one.
#[derive(Clone, Debug, Default)]
pub struct Configuration {
    /// Every file that was read for it, the requested one first: the files to watch.
    pub sources: Vec<Arc<Source>>,
    /// The components and links.
    pub system: System,
    /// The mission; without one every component is always active.
    pub mission: Option<Mission>,
    /// The missions that it, and these themselves, include as sub-missions, by
    /// [`Submission::path`](crate::mission::Submission::path); each once.
    pub included: BTreeMap<PathBuf, Mission>,
}

impl Configuration {
    /// The mission, and those put into it.
    pub fn missions(&self) -> impl Iterator<Item = &Mission> {
        self.mission.iter().chain(self.included.values())
    }

    /// Whether a mission activates and freezes the component.
    pub fn commands(&self, component: &Component) -> bool {
        let name = &component.name.value;
        component.controllable && self.missions().any(|mission| mission.controls(name))
    }
}

/// Which components there are, their parameters, their links.
#[derive(Clone, Debug, Default)]
pub struct System {
    /// The name, if it has one.
    pub name: Option<Spanned<String>>,
    /// The group of users of the host who may take part, besides the one who starts the system.
    pub group: Option<Spanned<String>>,
    /// The other hosts on which components run, in the order of the file.
    pub hosts: Vec<Host>,
    /// Where things are fixed on others, in the order of the file.
    pub frames: Vec<PlacedFrame>,
    /// The components in the order of the file.
    pub components: Vec<Component>,
    /// The links in the order of the file.
    pub links: Vec<Link>,
    /// The data that time follows, if it is not the host's clock.
    pub clock: Option<Clock>,
    /// The `<system>` tag; none without one.
    pub(crate) at: Option<Location>,
    /// The blocks of its layout.
    pub(crate) layout: Vec<LayoutBlock>,
    /// The parts that could not be read.
    pub(crate) unreadable: UnreadableParts,
}

impl System {
    /// The component called `name`.
    pub fn component(&self, name: &str) -> Option<&Component> {
        self.components.iter().find(|component| component.name.value == name)
    }
}

/// `<host name="arm" at="arm.local:7410"/>`: another host, whose agent runs components.
#[derive(Clone, Debug)]
pub struct Host {
    /// Its name, which is that in its key.
    pub name: Spanned<String>,
    /// Where its agent listens: names or addresses, each with a port, to be tried in turn.
    pub addresses: Spanned<Vec<String>>,
    /// What happens to its components while it is cut off.
    pub cut_off: CutOff,
    /// How long a mission waits for its components while it is cut off; by default as for those that
    /// have died.
    pub patience: Option<Duration>,
}

/// `<frame name="laser" in="base_link" x="0.08m"/>`: a frame that is fixed in another one.
#[derive(Clone, Debug)]
pub struct PlacedFrame {
    /// Its name.
    pub name: Spanned<String>,
    /// The frame that it is in.
    pub parent: Spanned<String>,
    /// Both, and where it is there.
    pub fixed: FixedFrame,
}

/// A component: an executable of some kind under a name.
#[derive(Clone, Debug)]
pub struct Component {
    /// Its name in the system.
    pub name: Spanned<String>,
    /// Its kind.
    pub kind: Spanned<String>,
    /// The host on which it runs; without one, that on which the system is started.
    pub host: Option<Spanned<String>>,
    /// The rate of its `exec`, in hertz; without one it is called when data arrives.
    pub rate_hz: Option<Spanned<f64>>,
    /// The behaviour when its process ends by itself.
    pub restart: Restart,
    /// How long one call of its code may take before its process is killed as hanging; without it,
    /// as long as it likes.
    pub watchdog: Option<Spanned<Duration>>,
    /// Whether the mission may freeze it.
    pub controllable: bool,
    /// Names of environment variables that its process gets of the launcher's, in addition to those
    /// that every process gets.
    pub variables: Option<Spanned<Vec<String>>>,
    /// What its process may use of the host.
    pub resources: ResourceLimits,
    /// The assigned parameters, in the order of the file.
    pub parameters: Vec<Parameter>,
}

impl Component {
    /// The value assigned to a parameter.
    pub fn parameter(&self, name: &str) -> Option<&Parameter> {
        self.parameters.iter().find(|parameter| parameter.name.value == name)
    }
}

/// The behaviour when a component's process ends by itself.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Restart {
    /// It is started again, however it ended.
    Always,
    /// It is started again unless it ended with code 0.
    #[default]
    OnFailure,
    /// It stays down.
    Never,
}

/// A value given to a parameter.
#[derive(Clone, Debug)]
pub struct Parameter {
    /// The parameter.
    pub name: Spanned<String>,
    /// The value as written; only the component's manifest knows its type.
    pub value: Spanned<String>,
    /// The folder that relative paths start from: the file's, or the one `--set` was given in.
    pub folder: PathBuf,
}

impl Parameter {
    /// Where it was assigned: `file:line:column`, or `--set`.
    pub fn origin(&self) -> String {
        match self.value.at.source.path().to_str() {
            Some(OVERRIDE) => OVERRIDE.to_owned(),
            _ => self.value.at.to_string(),
        }
    }
}

/// One output feeding one input.
#[derive(Clone, Debug)]
pub struct Link {
    /// The output.
    pub from: Port,
    /// The input.
    pub to: Port,
    /// Whether data is pushed or pulled.
    pub mode: LinkMode,
    /// The messages that a slow subscriber receives.
    pub keep: Keep,
    /// How the ends wait.
    pub wake: Wake,
    /// The transport.
    pub transport: Transport,
    /// The number of messages that the input stores.
    pub history: u32,
    /// The location of `keep`, if present.
    pub(crate) keep_at: Option<Location>,
    /// The location of `transport`, if present.
    pub(crate) transport_at: Option<Location>,
}

impl Link {
    /// The policy that its two ends agree on, which also depends on `mode` and `history`.
    pub fn find_policy(&self) -> Keep {
        match self.mode {
            LinkMode::Push => with_history(self.keep, self.history),
            LinkMode::Pull => Keep::Pull,
        }
    }
}

/// Returns the policy of a link that pushes and has a history: at least as many messages wait for a
/// busy component as its history has, otherwise it would have gaps.
pub(crate) fn with_history(keep: Keep, history: u32) -> Keep {
    let count = history.min(MAX_KEEP);
    match keep {
        Keep::Latest if count > 1 => Keep::Last { count },
        Keep::Last { count: few } if few < count => Keep::Last { count },
        _ => keep,
    }
}

/// `component.port`.
#[derive(Clone, Debug)]
pub struct Port {
    /// The component's name.
    pub component: Spanned<String>,
    /// The local name of its port.
    pub port: Spanned<String>,
    /// Both, as written.
    pub at: Location,
}

impl Port {
    /// The data's name in the whole system, `component.port`.
    pub fn data(&self) -> String {
        format!("{}.{}", self.component.value, self.port.value)
    }
}

/// Whether a link pushes or pulls.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum LinkMode {
    /// The provider sends as it publishes.
    #[default]
    Push,
    /// The consumer asks before each `exec`.
    Pull,
}

/// The transport of a link.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Transport {
    /// Whatever fits the two ends.
    #[default]
    Auto,
    /// TCP.
    Tcp,
    /// Shared memory.
    Shm,
    /// UDP.
    Udp,
}

impl Transport {
    /// Each transport with the word that the file uses for it.
    pub const NAMED: [(&str, Self); 4] =
        [("auto", Self::Auto), ("tcp", Self::Tcp), ("shm", Self::Shm), ("udp", Self::Udp)];

    /// Returns the word that the file uses for this transport.
    pub fn name(self) -> &'static str {
        match self {
            Self::Auto => "auto",
            Self::Tcp => "tcp",
            Self::Shm => "shm",
            Self::Udp => "udp",
        }
    }
}

/// A `<block>` of a layout, as written: a file may contain any layout.
#[derive(Clone, Debug)]
pub(crate) struct LayoutBlock {
    /// The component or place that it shows.
    pub(crate) of: Option<Spanned<String>>,
    /// The transition that it shows.
    pub(crate) transition: Option<Spanned<String>>,
    /// Its coordinates that are not numbers, each with the attribute's name.
    pub(crate) not_numbers: Vec<(&'static str, Spanned<String>)>,
}

/// `<clock source="sim.clock"/>`.
#[derive(Clone, Debug)]
pub struct Clock {
    /// The output that publishes the time.
    pub source: Port,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn as_many_messages_wait_as_the_history_has() {
        let last = |count| Keep::Last { count };
        assert_eq!(with_history(Keep::Latest, 1), Keep::Latest);
        assert_eq!(with_history(Keep::Latest, 9), last(9));
        assert_eq!(with_history(last(3), 9), last(9));
        assert_eq!(with_history(last(20), 9), last(20));
        assert_eq!(with_history(last(3), u32::MAX), last(MAX_KEEP));
        let all = Keep::All { patience_ms: 5 };
        assert_eq!(with_history(all, 9), all);
    }
}
