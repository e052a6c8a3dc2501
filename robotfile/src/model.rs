//! The typed model: what a file says, each piece with where it says it. Reading makes it as
//! complete as the text allows; whether it holds together is for [`crate::check`].

use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::Arc;
use std::time::Duration;

use armor_wire::keep::{Keep, Wake};

use crate::doubts::Doubts;
use crate::mission::Mission;
use crate::overrides::OVERRIDE;
use crate::source::{Location, Source, Spanned};

/// A system, and the mission over it if there is one.
#[derive(Clone, Debug)]
pub struct Configuration {
    /// Every file that was read for it, the one asked for first: what to watch.
    pub sources: Vec<Arc<Source>>,
    /// The components and links.
    pub system: System,
    /// The mission; without one every component is always active.
    pub mission: Option<Mission>,
    /// The missions that it, and these themselves, put in as sub-missions, by
    /// [`Submission::path`](crate::mission::Submission::path); each once.
    pub included: BTreeMap<PathBuf, Mission>,
}

impl Configuration {
    /// The mission, and those put into it.
    pub fn missions(&self) -> impl Iterator<Item = &Mission> {
        self.mission.iter().chain(self.included.values())
    }
}

/// Which components there are, their parameters, their links.
#[derive(Clone, Debug, Default)]
pub struct System {
    /// What it is called; may be missing.
    pub name: Option<Spanned<String>>,
    /// The components in the order of the file.
    pub components: Vec<Component>,
    /// The links in the order of the file.
    pub links: Vec<Link>,
    /// The data that time follows, if it is not the host's clock.
    pub clock: Option<Clock>,
    /// What it says and could not be read.
    pub(crate) doubts: Doubts,
}

impl System {
    /// The component called `name`.
    pub fn component(&self, name: &str) -> Option<&Component> {
        self.components.iter().find(|component| component.name.value == name)
    }
}

/// A component: an executable of some kind under a name.
#[derive(Clone, Debug)]
pub struct Component {
    /// Its name in the system.
    pub name: Spanned<String>,
    /// Its kind.
    pub kind: Spanned<String>,
    /// How often its `exec` is called, in hertz; without it, whenever data arrives.
    pub rate_hz: Option<Spanned<f64>>,
    /// What happens when it ends by itself.
    pub restart: Restart,
    /// How long one call of its code may take before its process is killed as hanging; without it,
    /// as long as it likes.
    pub watchdog: Option<Spanned<Duration>>,
    /// Whether the mission may freeze it.
    pub controllable: bool,
    /// What is assigned, in the order of the file.
    pub parameters: Vec<Parameter>,
}

impl Component {
    /// The value assigned to a parameter.
    pub fn parameter(&self, name: &str) -> Option<&Parameter> {
        self.parameters.iter().find(|parameter| parameter.name.value == name)
    }
}

/// What happens when a component's process ends by itself.
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
    /// Who asks for data.
    pub mode: LinkMode,
    /// What a slow consumer gets.
    pub keep: Keep,
    /// How the ends wait.
    pub wake: Wake,
    /// What the data travels on.
    pub transport: Transport,
    /// How many of the last data the input holds.
    pub history: u32,
    /// Attributes that are not at their default, for saying what is not played.
    pub(crate) unusual: Vec<Location>,
    /// Where it says what is kept, if it says it.
    pub(crate) keep_at: Option<Location>,
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

/// Who asks for data on a link.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum LinkMode {
    /// The provider sends as it publishes.
    #[default]
    Push,
    /// The consumer asks before each `exec`.
    Pull,
}

/// What a link's data travels on.
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

/// `<clock source="sim.clock"/>`.
#[derive(Clone, Debug)]
pub struct Clock {
    /// The output that says what time it is.
    pub source: Port,
}
