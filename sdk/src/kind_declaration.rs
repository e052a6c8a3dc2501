//! What a kind of component declares outside its constructor: in Rust as constants, in another language
//! while it runs.

use armor_wire::manifest::{EventManifest, ParameterManifest, PortFrame, ValueEffect};

use crate::component::Component;
use crate::event::DeclaredEvent;
use crate::parameter::Parameter;
use crate::participant::Declarations;

/// What a constructor may not do while nothing is behind it.
pub(crate) const CONSTRUCTOR_RULE: &str = "`new` runs for --describe too and opens no hardware or \
                                           files: do that at Call::Started";

/// See [`KindDeclaration::thread_scope`].
pub type ThreadScope = fn(work: &mut (dyn FnMut() + Send));

/// What a kind of component declares next to its ports; as the constants of
/// [`Component`](crate::Component), which explains each of them.
#[derive(Clone, Debug)]
pub struct KindDeclaration {
    /// Name of this kind of component, as the file has it.
    pub kind: String,
    /// What it does, in one line.
    pub summary: String,
    /// What can be set in the file.
    pub parameters: Vec<ParameterManifest>,
    /// What each port carries, in one line: the port and the text.
    pub ports: Vec<(String, String)>,
    /// The events that it reports.
    pub events: Vec<EventManifest>,
    /// Whether it ever reports that it is done.
    pub reports_done: bool,
    /// Whether its task comes to an end by itself.
    pub ends_by_itself: bool,
    /// Whether it does nothing without a rate.
    pub needs_rate: bool,
    /// Whether it reads data to which no link leads.
    pub reads_all: bool,
    /// Groups of inputs and parameters of which one must be fed or given.
    pub needs_one_of: Vec<Vec<String>>,
    /// Inputs and the age from which on it takes their data for missing.
    pub stale_after: Vec<(String, String)>,
    /// Values of parameters that decide whether, and when, it does what it is for.
    pub value_effects: Vec<ValueEffect>,
    /// Ports whose data are taken in a frame of the robot.
    pub frames: Vec<PortFrame>,
    /// Runs what each thread that brings data does: a runtime that has to know the thread
    /// may do it once here, not at each call. `|work| work()` if there is nothing to do.
    pub thread_scope: ThreadScope,
    /// What its constructor may not do, in the words of its language: the remedy where it fails for
    /// `--describe`.
    pub constructor_rule: &'static str,
}

impl KindDeclaration {
    /// A kind without parameters and events, which may report that it is done.
    pub fn new(kind: &str, summary: &str) -> Self {
        Self {
            kind: kind.into(),
            summary: summary.into(),
            parameters: Vec::new(),
            ports: Vec::new(),
            events: Vec::new(),
            reports_done: true,
            ends_by_itself: false,
            needs_rate: false,
            reads_all: false,
            needs_one_of: Vec::new(),
            stale_after: Vec::new(),
            value_effects: Vec::new(),
            frames: Vec::new(),
            thread_scope: |work| work(),
            constructor_rule: CONSTRUCTOR_RULE,
        }
    }

    /// The constants of a Rust component.
    pub(crate) fn of<C: Component>() -> Self {
        let own = |(name, text): &(&str, &str)| ((*name).to_owned(), (*text).to_owned());
        let groups = C::NEEDS_ONE_OF.iter();
        let frames = C::FRAMES.iter().map(own);
        Self {
            kind: C::KIND.into(),
            summary: C::SUMMARY.into(),
            parameters: C::PARAMETERS.iter().map(Parameter::manifest).collect(),
            ports: C::PORTS.iter().map(own).collect(),
            events: C::EVENTS.iter().map(DeclaredEvent::manifest).collect(),
            reports_done: C::REPORTS_DONE,
            ends_by_itself: C::ENDS_BY_ITSELF,
            needs_rate: C::NEEDS_RATE,
            reads_all: C::READS_ALL,
            needs_one_of: groups.map(|ids| ids.iter().map(|id| (*id).into()).collect()).collect(),
            stale_after: C::STALE_AFTER.iter().map(own).collect(),
            value_effects: C::VALUE_EFFECTS.iter().map(|(name, it)| it.manifest(name)).collect(),
            frames: frames.map(|(port, parameter)| PortFrame { port, parameter }).collect(),
            thread_scope: |work| work(),
            constructor_rule: CONSTRUCTOR_RULE,
        }
    }

    pub(crate) fn declarations(&self) -> Declarations {
        Declarations {
            parameters: self.parameters.clone(),
            events: self.events.clone(),
            reports_done: self.reports_done,
        }
    }
}
