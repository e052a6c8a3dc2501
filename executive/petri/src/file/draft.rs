//! A net while its file is read, in which arcs may precede their places and transitions.

use super::{FileError, NetFile, Note, fault_at};
use crate::net::{FiringClass, FiringInterval, Net, PlaceId};

/// The kind of an arc between a place and a transition.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum NetArcKind {
    Input,
    Output,
    Read,
    Inhibitor,
    Reset,
}

#[derive(Debug)]
pub(super) struct DraftPlace {
    pub name: String,
    pub tokens: u32,
    pub note: Note,
}

#[derive(Debug)]
pub(super) struct DraftTransition {
    pub name: String,
    pub note: Note,
    pub interval: FiringInterval,
    pub class: FiringClass,
    pub priority: i32,
    pub gated: bool,
    pub arcs: Vec<(NetArcKind, u32, u32)>,
    /// Offset of its declaration in the text.
    pub at: usize,
}

impl DraftTransition {
    pub fn new(name: String, at: usize) -> Self {
        Self {
            name,
            note: Note::default(),
            interval: FiringInterval::UNTIMED,
            class: FiringClass::Ordinary,
            priority: 0,
            gated: false,
            arcs: Vec::new(),
            at,
        }
    }
}

#[derive(Debug, Default)]
pub(super) struct NetDraft {
    pub name: String,
    pub places: Vec<DraftPlace>,
    pub transitions: Vec<DraftTransition>,
}

impl NetDraft {
    /// Builds the net. A fault of the net gets the position of its transition.
    pub fn build(self, text: &str) -> Result<NetFile, FileError> {
        let mut net = Net::builder();
        let mut notes = (Vec::new(), Vec::new());
        for place in self.places {
            net.place(place.name, place.tokens);
            notes.0.push(place.note);
        }
        let offsets: Vec<_> = self.transitions.iter().map(|t| t.at).collect();
        let names: Vec<_> = self.transitions.iter().map(|t| t.name.clone()).collect();
        for draft in self.transitions {
            let mut t = net
                .transition(draft.name)
                .interval(draft.interval)
                .class(draft.class)
                .priority(draft.priority);
            for (kind, place, weight) in draft.arcs {
                let place = PlaceId(place);
                t = match kind {
                    NetArcKind::Input => t.input(place, weight),
                    NetArcKind::Output => t.output(place, weight),
                    NetArcKind::Read => t.read(place, weight),
                    NetArcKind::Inhibitor => t.inhibitor(place, weight),
                    NetArcKind::Reset => t.reset(place),
                };
            }
            if draft.gated {
                t.gated();
            }
            notes.1.push(draft.note);
        }
        let net = net.build().map_err(|error| {
            let culprit = names.iter().position(|name| error.transition() == Some(name.as_str()));
            let at = culprit.map_or(0, |index| offsets[index]);
            fault_at(text, at, error.into())
        })?;
        Ok(NetFile { name: self.name, net, places: notes.0, transitions: notes.1 })
    }
}
