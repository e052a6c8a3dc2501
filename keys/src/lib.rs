//! Keys: who may reach a system from another host. An authority makes one key for each person and
//! each robot's host; both ends of a connection between hosts prove theirs.
//!
//! Start with [`identity`] (what a key contains), then [`authority`] (how one is made), [`folder`]
//! (where they are kept) and [`tls`] (how they are verified). [`gate`] and [`connect`] are the two ends
//! of a connection between hosts.

mod addresses;
pub mod authority;
pub mod authority_certificate;
pub mod certificate;
pub mod connect;
mod copying;
mod datagrams;
mod dial;
pub mod discovery;
pub mod expiry;
pub mod folder;
mod frames;
pub mod gate;
mod host_keys;
pub mod identity;
pub mod invitation_file;
pub mod invitations;
pub mod key_file;
pub mod page_port;
pub mod reach;
mod redial;
mod replay;
pub mod revoked;
pub mod routes;
pub mod run_channel;
mod seal;
mod site_name;
mod socks;
mod streams;
pub mod tls;

#[cfg(test)]
mod tests;

pub use authority::{Authority, NewKey, Validity};
pub use certificate::{CertificateFacts, Serial};
pub use folder::KeysFolder;
pub use gate::{StrangerPlace, Strangers};
pub use host_keys::{GateKeysError, HostKeys, KeysChange};
pub use identity::{KeyHolder, KeyPurpose};
pub use key_file::{KeyFile, KeyFileError};
pub use revoked::RevokedKeys;
pub use site_name::{MAX_SITES, SiteName};

/// The DNS name in the certificate of every gate. A person's certificate has none, so that a person
/// cannot pass for a gate.
pub(crate) const GATE_NAME: &str = "gate.armor";
