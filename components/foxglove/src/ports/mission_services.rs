//! The services of the mission: an order of a person, called as a service of ROS.

use std::time::Duration;

use armor_recording::ros::RosMessage;
use armor_sdk::control::{Command, Order};
use armor_sdk::operator::Operator;
use armor_wire::WireType;
use armor_wire::acting::{KeyRole, NeedsRole};
use armor_wire::codec;
use serde_json::{Value, json};

use super::published_message::decode_message;
use super::viewer_messages::{OrderAnswer, TransitionRequest};
use crate::viewer_protocol::{CDR, JSON, ROS2_MSG, ServiceCall};

/// How long an order may wait for the executive's answer.
const ANSWER_WITHIN: Duration = Duration::from_secs(5);

/// A service; its number is its place in [`MissionService::ALL`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum MissionService {
    Pause,
    Resume,
    Safe,
    Fire,
    Confirm,
    Decline,
}

/// A call that can be carried out.
#[derive(Debug)]
pub(super) struct MissionCall {
    pub(super) order: Order,
    is_json: bool,
}

impl MissionService {
    const ALL: [Self; 6] =
        [Self::Pause, Self::Resume, Self::Safe, Self::Fire, Self::Confirm, Self::Decline];

    /// Returns the service with a number.
    pub(super) fn numbered(number: u32) -> Option<Self> {
        Self::ALL.get(usize::try_from(number).ok()?).copied()
    }

    /// Returns the names of all services.
    pub(super) fn names() -> impl Iterator<Item = &'static str> {
        Self::ALL.into_iter().map(Self::name)
    }

    fn name(self) -> &'static str {
        match self {
            Self::Pause => "/mission/pause",
            Self::Resume => "/mission/resume",
            Self::Safe => "/mission/safe",
            Self::Fire => "/mission/fire",
            Self::Confirm => "/mission/confirm",
            Self::Decline => "/mission/decline",
        }
    }

    fn has_transition(self) -> bool {
        matches!(self, Self::Fire | Self::Confirm | Self::Decline)
    }

    /// Reads a call.
    ///
    /// # Errors
    /// In words, if its encoding or its request is wrong.
    pub(super) fn read_call(self, call: &ServiceCall<'_>) -> Result<MissionCall, String> {
        let is_json = match call.encoding {
            CDR => false,
            JSON => true,
            other => {
                let encoding = other.escape_default();
                return Err(format!("the encoding `{encoding}` is not taken: use cdr or json"));
            }
        };
        let mut transition = String::new();
        if self.has_transition() {
            let request: TransitionRequest = decode_message(is_json, call.payload)?;
            transition = request.transition;
        }
        let order = match self {
            Self::Pause => Order::Pause,
            Self::Resume => Order::Resume,
            Self::Safe => Order::Safe,
            Self::Fire => Order::Fire { transition },
            Self::Confirm => Order::Confirm { transition },
            Self::Decline => Order::Decline { transition },
        };
        // Any number but 0, and any author: both are set when the order is sent.
        order.check(1, "-").map_err(|fault| fault.to_string())?;
        Ok(MissionCall { order, is_json })
    }
}

impl MissionCall {
    /// Returns the role that the order needs, and what it is in words.
    pub(super) fn needed_role(&self) -> (Option<KeyRole>, String) {
        let (request, author) = (1, String::new());
        let command = Command::Order { request, author, take: false, order: self.order.clone() };
        (command.needed_role(), command.describe())
    }

    /// Gives the order, and returns the encoded response. Blocks until the executive answers.
    ///
    /// # Errors
    /// In words, if there is no answer.
    pub(super) fn carry_out(&self, operator: &mut Operator) -> Result<Vec<u8>, String> {
        let verdict = operator.order(false, &self.order, ANSWER_WITHIN);
        let verdict = verdict.map_err(|error| error.to_string())?;
        self.encode_answer(OrderAnswer { success: verdict.accepted, message: verdict.text })
    }

    fn encode_answer(&self, answer: OrderAnswer) -> Result<Vec<u8>, String> {
        if self.is_json {
            let OrderAnswer { success, message } = answer;
            return Ok(json!({"success": success, "message": message}).to_string().into_bytes());
        }
        let bytes = codec::encode(&answer).map_err(|error| error.to_string())?;
        let encoded = RosMessage::new(&OrderAnswer::schema()).encode(&bytes);
        encoded.map(|encoded| encoded.bytes).map_err(|error| error.to_string())
    }
}

/// Composes the announcement of all services.
pub(super) fn compose_services() -> String {
    let part = |name: String, schema: &str| json!({"encoding": CDR, "schemaName": name, "schemaEncoding": ROS2_MSG, "schema": schema});
    let services: Vec<Value> = (0..)
        .zip(MissionService::ALL)
        .map(|(id, service): (u32, _)| {
            let (kind, request) = match service.has_transition() {
                true => ("armor_msgs/srv/TransitionOrder", "string transition\n"),
                false => ("std_srvs/srv/Trigger", ""),
            };
            json!({
                "id": id,
                "name": service.name(),
                "type": kind,
                "request": part(format!("{kind}_Request"), request),
                "response": part(format!("{kind}_Response"), "bool success\nstring message\n"),
            })
        })
        .collect();
    json!({"op": "advertiseServices", "services": services}).to_string()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(service: MissionService, encoding: &str, payload: &[u8]) -> Result<Order, String> {
        let call = ServiceCall { service: 0, call: 0, encoding, payload };
        service.read_call(&call).map(|call| call.order)
    }

    #[test]
    fn calls_are_read_in_both_encodings() {
        assert_eq!(read(MissionService::Pause, JSON, b"{}"), Ok(Order::Pause));
        assert_eq!(read(MissionService::Safe, CDR, &[0, 1, 0, 0]), Ok(Order::Safe));
        let home = Order::Fire { transition: "home".into() };
        let fired = read(MissionService::Fire, JSON, br#"{"transition":"home"}"#);
        assert_eq!(fired, Ok(home.clone()));
        let cdr = [0, 1, 0, 0, 5, 0, 0, 0, b'h', b'o', b'm', b'e', 0];
        assert_eq!(read(MissionService::Fire, CDR, &cdr), Ok(home));
        assert!(read(MissionService::Fire, CDR, &[0, 1, 0, 0]).is_err());
        assert!(read(MissionService::Fire, JSON, br#"{"transition":""}"#).is_err());
        assert!(read(MissionService::Pause, "xml", b"").is_err());
    }

    #[test]
    fn the_role_is_that_of_the_table_and_responses_are_what_is_announced() {
        let role = |order| MissionCall { order, is_json: false }.needed_role().0;
        assert_eq!(role(Order::Pause), Some(KeyRole::Observer));
        assert_eq!(role(Order::Resume), Some(KeyRole::Operator));
        let schema = RosMessage::new(&OrderAnswer::schema());
        let definition: String =
            schema.definition().lines().map(|line| format!("{line}\n")).collect();
        assert!(
            compose_services().contains(&definition.escape_default().to_string()),
            "{definition}"
        );
        let answer = OrderAnswer { success: true, message: "ok".into() };
        let call = MissionCall { order: Order::Pause, is_json: false };
        let bytes = [0, 1, 0, 0, 1, 0, 0, 0, 3, 0, 0, 0, b'o', b'k', 0];
        assert_eq!(call.encode_answer(answer), Ok(bytes.to_vec()));
    }
}
