//! Protocol violations go to the log once per peer address and kind, so that they cannot fill a
//! disk.

use std::borrow::Cow;
use std::net::SocketAddr;

use tracing::warn;

use crate::faults::FaultTable;
use armor_wire::peer::CloseReason;

/// Logs why connections ended.
#[derive(Default)]
pub(crate) struct CloseLog {
    logged: FaultTable<Cow<'static, str>>,
}

impl CloseLog {
    /// Logs why a connection ended, if the peer is to blame and it is the first such fault of its
    /// address.
    pub(crate) fn log_close(&self, address: SocketAddr, reason: &CloseReason) {
        if let Some(fault) = reason.fault_kind()
            && self.logged.is_new(Some(address.ip()), fault)
        {
            warn!(%address, %reason, "connection closed; further ones like it are not logged");
        }
    }
}
