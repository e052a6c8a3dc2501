//! On whose behalf a connection acts that a gate forwards, and what that person or host may request.
//!
//! A gate has authenticated the other end by its key. It begins the connection to a process of the
//! system with a [`Preface`], which names the holder of the key and its rights. A process believes it
//! because the gate belongs to its own user; a preface only takes rights away. [`Opening`] is the one
//! place where it is read, and [`NeedsRole`] the one table of what each role may do.

use std::fmt;
use std::str::FromStr;

use crate::Message;
use crate::codec;
use crate::config::ConfigRequest;
use crate::control::{Command, Order, Role};
use crate::frame::{Frame, FrameKind};
use crate::hello::{HandshakeError, Hello, LinkRequest, Purpose};
use crate::keep::{Keep, Wake};
use crate::name::is_name;
use crate::refusal::{Refusal, RefusalCode};

/// What the holder of a key may do. Each role may also do what those before it may.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Message)]
#[message(wire = "armor_wire")]
pub enum KeyRole {
    /// Reads everything, and may bring the robot to rest: pause the mission, or send it to its safe
    /// place.
    Observer,
    /// Commands the mission.
    Operator,
    /// Changes parameters, which are in the file, and what processes log.
    Engineer,
}

impl KeyRole {
    /// All of them, from the least to the most.
    pub const ALL: [Self; 3] = [Self::Observer, Self::Operator, Self::Engineer];

    /// Its name, as certificates and command lines have it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Observer => "observer",
            Self::Operator => "operator",
            Self::Engineer => "engineer",
        }
    }
}

impl fmt::Display for KeyRole {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

impl FromStr for KeyRole {
    type Err = String;
    fn from_str(text: &str) -> Result<Self, String> {
        let named = Self::ALL.into_iter().find(|role| role.name() == text);
        named.ok_or_else(|| "a role is observer, operator or engineer".to_owned())
    }
}

/// What the other end of a connection may do that a gate forwards.
#[derive(Clone, Debug, PartialEq, Eq, Message)]
#[message(wire = "armor_wire")]
pub enum Rights {
    /// A person: what the role in the certificate allows.
    Person {
        /// The role.
        role: KeyRole,
    },
    /// Another host of the same system, for the components that the file places there.
    Host {
        /// The names under which its processes may register.
        components: Vec<String>,
    },
    /// The host on which the system was started: registry, executive and launcher run there.
    Launcher,
}

/// The first frame of a connection that a gate forwards.
#[derive(Clone, Debug, PartialEq, Eq, Message)]
#[message(wire = "armor_wire")]
pub struct Preface {
    /// The holder of the key, as its certificate names it: a person or a host.
    pub name: String,
    /// What it may do.
    pub rights: Rights,
}

impl Preface {
    /// The preface of a person.
    pub fn of_person(name: &str, role: KeyRole) -> Self {
        Self { name: name.to_owned(), rights: Rights::Person { role } }
    }

    /// The role, if the holder is a person.
    pub fn role(&self) -> Option<KeyRole> {
        match self.rights {
            Rights::Person { role } => Some(role),
            Rights::Host { .. } | Rights::Launcher => None,
        }
    }

    /// The author of an order that was sent under the name `claimed`: the holder of the key, for a host
    /// with what the process there claims.
    pub fn name_author(&self, claimed: &str) -> String {
        match self.rights {
            Rights::Person { .. } => self.name.clone(),
            Rights::Host { .. } => format!("{claimed} at {}", self.name),
            Rights::Launcher => claimed.to_owned(),
        }
    }

    /// Checks whether the rights allow a request.
    ///
    /// # Errors
    /// The refusal names the role that the request needs.
    pub fn check(&self, request: &impl NeedsRole) -> Result<(), Refusal> {
        let (name, what) = (&self.name, request.describe());
        let text = match &self.rights {
            Rights::Launcher => return Ok(()),
            Rights::Host { components } if request.is_open_to_host(name, components) => {
                return Ok(());
            }
            Rights::Host { .. } => {
                format!("{what} is not for the host {name}: the file does not place that there")
            }
            Rights::Person { role } => match request.needed_role() {
                Some(needed) if *role >= needed => return Ok(()),
                Some(needed) => format!(
                    "{what} needs the role {needed}, and the key of {name} has the role {role}"
                ),
                None => format!(
                    "{what} is only for processes on the hosts of the system, not for the key of \
                     {name}; through ssh it is possible (docs/keys.md)"
                ),
            },
        };
        Err(Refusal::new(RefusalCode::Role, text))
    }
}

/// A request that a role may be too low for.
pub trait NeedsRole {
    /// The least role that may send it through a gate; `None` if none may.
    fn needed_role(&self) -> Option<KeyRole>;
    /// Whether a host of the system may send it on which only these components run. A component
    /// there may command the mission, as the operator's screen does.
    fn is_open_to_host(&self, _host: &str, _components: &[String]) -> bool {
        self.needed_role().is_some_and(|needed| needed <= KeyRole::Operator)
    }
    /// What it is, as the subject of a sentence.
    fn describe(&self) -> String;
}

impl NeedsRole for Purpose {
    fn needed_role(&self) -> Option<KeyRole> {
        match self {
            Self::Registry { entry: None } | Self::Config => Some(KeyRole::Observer),
            // A component accepts connections too, and nothing forwards them to a person's computer.
            Self::Registry { entry: Some(_) } => None,
            // The publisher would wait for a subscriber that is slow on purpose, or spin for it.
            Self::Link { link: LinkRequest { keep: Keep::All { .. }, .. } }
            | Self::Link { link: LinkRequest { wake: Wake::Spin, .. } } => None,
            Self::Link { .. } => Some(KeyRole::Observer),
            // Every order is checked on its own: any key may bring the robot to rest.
            Self::Control { role: Role::Observer | Role::Operator } => Some(KeyRole::Observer),
            Self::Control { role: Role::Executive | Role::Launcher } => None,
        }
    }

    fn is_open_to_host(&self, host: &str, components: &[String]) -> bool {
        match self {
            Self::Registry { entry: Some(entry) } => {
                // An address in numbers would lead other hosts past its gate.
                let port = entry.endpoint.strip_prefix(host).and_then(|it| it.strip_prefix(':'));
                let is_of_host = port.is_some_and(|port| port.parse::<u16>().is_ok());
                is_of_host && entry.host == host && components.contains(&entry.name)
            }
            Self::Control { role: Role::Executive | Role::Launcher } => false,
            // Also links for which the publisher waits: the file asks for them. Which data the host may
            // read is proven by the key of the link.
            Self::Registry { entry: None }
            | Self::Config
            | Self::Link { .. }
            | Self::Control { role: Role::Observer | Role::Operator } => true,
        }
    }

    fn describe(&self) -> String {
        match self {
            Self::Registry { entry: None } => "a request to the registry".into(),
            Self::Registry { entry: Some(entry) } => {
                format!("registering the component {}", entry.name)
            }
            Self::Config => "a request to configd".into(),
            Self::Link { link } if self.needed_role().is_none() => {
                format!("a link to {} for which its publisher waits", link.data)
            }
            Self::Link { link } => format!("reading {}", link.data),
            Self::Control { role } => format!("a control connection as {role:?}"),
        }
    }
}

impl NeedsRole for Command {
    fn needed_role(&self) -> Option<KeyRole> {
        match self {
            Self::Status { .. } | Self::Beat => Some(KeyRole::Observer),
            // Taking the command away from its holder is more than bringing the robot to rest.
            Self::Order { order: Order::Pause | Order::Safe, take: false, .. } => {
                Some(KeyRole::Observer)
            }
            Self::Order { .. } => Some(KeyRole::Operator),
            Self::Playback { .. } => Some(KeyRole::Operator),
            Self::SetLogFilter { .. } => Some(KeyRole::Engineer),
            Self::Activate { .. }
            | Self::Freeze { .. }
            | Self::Terminate
            | Self::Acknowledge { .. } => None,
        }
    }

    fn describe(&self) -> String {
        match self {
            Self::Status { .. } => "asking for a status".into(),
            Self::Beat => "a beat".into(),
            Self::Order { order, take, .. } => {
                let what = match order {
                    Order::Lease => "taking the command",
                    Order::Release => "returning the command",
                    Order::Fire { .. } => "firing a transition",
                    Order::Pause => "pausing the mission",
                    Order::Resume => "resuming the mission",
                    Order::Safe => "sending the mission to its safe place",
                    Order::Move { .. } => "moving tokens",
                    Order::Confirm { .. } => "confirming a transition",
                    Order::Decline { .. } => "declining a transition",
                    Order::Rejoin => "keeping the command",
                };
                let take = if *take { " and taking the command from its holder" } else { "" };
                format!("{what}{take}")
            }
            Self::SetLogFilter { .. } => "changing what a process logs".into(),
            Self::Playback { .. } => "controlling the playback".into(),
            Self::Activate { .. } => "activating a component".into(),
            Self::Freeze { .. } => "freezing a component".into(),
            Self::Terminate => "ending a process".into(),
            Self::Acknowledge { .. } => "acknowledging a report".into(),
        }
    }
}

impl NeedsRole for ConfigRequest {
    fn needed_role(&self) -> Option<KeyRole> {
        Some(match self {
            Self::Settings { .. }
            | Self::Parameter { .. }
            | Self::List { .. }
            | Self::Diff { .. }
            | Self::Beat => KeyRole::Observer,
            Self::Set { .. } => KeyRole::Engineer,
        })
    }

    fn describe(&self) -> String {
        match self {
            Self::Set { component, parameter, .. } => format!("setting {component}.{parameter}"),
            _ => "reading the configuration".into(),
        }
    }
}

/// Reads the frames with which a connection begins: a hello, or a preface and a hello.
#[derive(Debug, Default)]
pub struct Opening {
    preface: Option<Preface>,
}

impl Opening {
    /// Reads the next frame. `None`: it is a preface, which must be acknowledged with a beat before
    /// more is read. The hello is one that the role allows.
    ///
    /// # Errors
    /// As [`Hello::read`]; and [`HandshakeError::Refused`] if the role does not allow the purpose.
    pub fn read_frame(&mut self, frame: &Frame<'_>) -> Result<Option<Hello>, HandshakeError> {
        if frame.kind == FrameKind::Preface && self.preface.is_none() {
            let preface: Preface = codec::decode_control(frame.body)?;
            if !is_name(&preface.name) {
                let text = "the preface does not name the holder of a key";
                return Err(Refusal::new(RefusalCode::Malformed, text).into());
            }
            self.preface = Some(preface);
            return Ok(None);
        }
        let hello = Hello::read(frame)?;
        if let Some(preface) = &self.preface {
            preface.check(&hello.purpose)?;
        }
        Ok(Some(hello))
    }

    /// On whose behalf the connection acts; `None` for a process of the host, which acts for itself.
    pub fn preface(&self) -> Option<&Preface> {
        self.preface.as_ref()
    }

    /// Returns the same as [`Self::preface`].
    pub fn into_preface(self) -> Option<Preface> {
        self.preface
    }
}

#[cfg(test)]
mod tests;
