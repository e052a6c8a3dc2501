//! The messages that only this component has: its clients, and the services of the mission.

use armor_sdk::Message;

/// The viewers that are connected, published every second.
#[derive(Clone, Debug, Default, PartialEq, Message)]
pub struct ViewerClients {
    /// System time, in seconds.
    #[message(unit = "s")]
    pub stamp: f64,
    /// Each of them.
    pub clients: Vec<ViewerClient>,
}

/// A connected viewer.
#[derive(Clone, Debug, Default, PartialEq, Message)]
pub struct ViewerClient {
    /// Its address.
    pub address: String,
    /// Number of topics that it has subscribed to.
    pub subscriptions: u32,
    /// Messages given to its connection.
    pub sent: u64,
    /// Messages dropped because it read too slowly.
    pub dropped: u64,
    /// Bytes that wait for it.
    #[message(unit = "B")]
    pub waiting_bytes: u64,
    /// Whether it is the one that drives.
    pub driving: bool,
}

/// The request of a service that is about one transition.
#[derive(Clone, Debug, Default, PartialEq, Message)]
pub(super) struct TransitionRequest {
    /// The transition.
    pub(super) transition: String,
}

/// The response of every service; its fields are those of `std_srvs/srv/Trigger`.
#[derive(Clone, Debug, Default, PartialEq, Message)]
pub(super) struct OrderAnswer {
    /// Whether the order is carried out.
    pub(super) success: bool,
    /// What follows from it, or why it is refused.
    pub(super) message: String,
}
