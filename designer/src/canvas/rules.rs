//! What may be joined in a drawing.

use crate::canvas::node::PortAt;

/// What may be joined in a drawing.
pub trait JoinRules {
    /// Whether a wire between two ports is allowed, whichever it was dragged from; else why not, in
    /// a few words for a person.
    ///
    /// # Errors
    /// Why it is not allowed.
    fn may_join(&self, from: PortAt, to: PortAt) -> Result<(), String>;

    /// The same for a wire that is led elsewhere, whose other end stays at a port.
    ///
    /// # Errors
    /// Why it is not allowed.
    fn may_lead(&self, wire: usize, stays: PortAt, to: PortAt) -> Result<(), String> {
        let _ = wire;
        self.may_join(stays, to)
    }

    /// The wire that a drag from this port takes by its end, instead of beginning a new one.
    fn taken_by(&self, port: PortAt) -> Option<usize> {
        let _ = port;
        None
    }
}
