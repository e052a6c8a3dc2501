//! The sockets of Armor: one [`Stream`] and one [`Listener`] whatever the transport, where
//! processes listen, how they connect, and how a socket is tuned.
//!
//! Start with [`stream`]. The daemons' server of typed messages, which needs an async runtime, is
//! in
//! [`daemon`] and exists with the feature `daemon` only.

pub mod connect;
#[cfg(feature = "daemon")]
pub mod daemon;
pub mod datagram;
pub mod faults;
pub mod hosts;
mod identity;
pub mod listener;
mod loopback;
pub mod owner;
mod passing;
pub mod port_holder;
mod proxy;
pub mod run_keys;
pub mod stream;
mod tuning;

pub use connect::{connect, connect_component};
#[cfg(feature = "daemon")]
pub use daemon::{Registration, RegistrationStatus, Server, ServerLimits};
pub use datagram::{DatagramSocket, enlarge_datagram_buffers};
pub use faults::{AcceptLog, FaultTable, is_temporary};
pub use hosts::{HostPlace, adopt_place, name_endpoint};
pub use identity::{host_name, random_id};
pub use listener::{ComponentListeners, ListenError, Listener, PORTS, listen};
pub use loopback::is_loopback_name;
pub use owner::{
    GROUP_VARIABLE, OwnerError, check_client, check_unix, has_group, is_closed_already,
    own_connection,
};
pub use port_holder::explain_bind_error;
pub use proxy::has_proxy;
pub use run_keys::{adopt_secret, own_key, own_secret};
pub use stream::Stream;
pub use tuning::{enlarge_send_buffer, tune, tune_between_hosts};
