//! The messages of the protocol `foxglove.sdk.v1`: JSON in both directions, and binary messages that
//! begin with their kind. Pure. Numbers in binary messages are little-endian.

use serde::Deserialize;
use serde_json::{Value, json};
use thiserror::Error;

/// Kinds of binary messages of the server.
const MESSAGE_DATA: u8 = 1;
const TIME: u8 = 2;
const SERVICE_RESPONSE: u8 = 3;
/// Kinds of binary messages of a client.
const CLIENT_DATA: u8 = 1;
const SERVICE_REQUEST: u8 = 2;

/// The encoding of the data: CDR, as in ROS 2.
pub(crate) const CDR: &str = "cdr";
/// The other encoding that a client may publish in.
pub(crate) const JSON: &str = "json";
/// The form of the definitions.
pub(crate) const ROS2_MSG: &str = "ros2msg";

/// A JSON message of a client. Fields that are not listed here are ignored, as the protocol demands.
#[derive(Debug, Deserialize, PartialEq)]
#[serde(tag = "op", rename_all = "camelCase", rename_all_fields = "camelCase")]
pub(crate) enum ViewerRequest {
    Subscribe { subscriptions: Vec<WantedSubscription> },
    Unsubscribe { subscription_ids: Vec<u32> },
    Advertise { channels: Vec<ClientChannel> },
    Unadvertise { channel_ids: Vec<u32> },
    GetParameters { parameter_names: Vec<String>, id: Option<String> },
    SetParameters { parameters: Vec<ParameterChange>, id: Option<String> },
    SubscribeParameterUpdates { parameter_names: Vec<String> },
    UnsubscribeParameterUpdates { parameter_names: Vec<String> },
    SubscribeConnectionGraph,
    UnsubscribeConnectionGraph,
}

/// A channel that a client subscribes to, under a number of its choice.
#[derive(Debug, Deserialize, PartialEq)]
#[serde(rename_all = "camelCase")]
pub(crate) struct WantedSubscription {
    pub(crate) id: u32,
    pub(crate) channel_id: u32,
}

/// A topic that a client publishes, under a number of its choice.
#[derive(Clone, Debug, Deserialize, PartialEq)]
#[serde(rename_all = "camelCase")]
pub(crate) struct ClientChannel {
    pub(crate) id: u32,
    pub(crate) topic: String,
    pub(crate) encoding: String,
    #[serde(default)]
    pub(crate) schema_name: String,
}

/// A new value of a parameter; without one, the default.
#[derive(Clone, Debug, Deserialize, PartialEq)]
pub(crate) struct ParameterChange {
    pub(crate) name: String,
    pub(crate) value: Option<Value>,
}

/// A binary message of a client.
#[derive(Debug, PartialEq)]
pub(crate) enum ViewerFrame<'a> {
    Data { channel: u32, payload: &'a [u8] },
    ServiceCall(ServiceCall<'a>),
}

/// A call of a service.
#[derive(Debug, PartialEq)]
pub(crate) struct ServiceCall<'a> {
    pub(crate) service: u32,
    pub(crate) call: u32,
    pub(crate) encoding: &'a str,
    pub(crate) payload: &'a [u8],
}

/// Why a message of a client cannot be read.
#[derive(Debug, Error)]
pub(crate) enum ProtocolFault {
    #[error("the request is not understood: {0}")]
    Json(#[from] serde_json::Error),
    #[error("a binary message of kind {0} is unknown")]
    UnknownKind(u8),
    #[error("a binary message ends too early")]
    TooShort,
    #[error("the encoding of a service call is no text")]
    NoText,
}

/// Reads a JSON message.
pub(crate) fn read_request(text: &str) -> Result<ViewerRequest, ProtocolFault> {
    Ok(serde_json::from_str(text)?)
}

/// Reads a binary message.
pub(crate) fn read_frame(bytes: &[u8]) -> Result<ViewerFrame<'_>, ProtocolFault> {
    let (kind, rest) = bytes.split_first().ok_or(ProtocolFault::TooShort)?;
    match *kind {
        CLIENT_DATA => {
            let (channel, payload) = take_number(rest)?;
            Ok(ViewerFrame::Data { channel, payload })
        }
        SERVICE_REQUEST => {
            let (service, rest) = take_number(rest)?;
            let (call, rest) = take_number(rest)?;
            let (len, rest) = take_number(rest)?;
            let len = usize::try_from(len).map_err(|_| ProtocolFault::TooShort)?;
            let (encoding, payload) = rest.split_at_checked(len).ok_or(ProtocolFault::TooShort)?;
            let encoding = str::from_utf8(encoding).map_err(|_| ProtocolFault::NoText)?;
            Ok(ViewerFrame::ServiceCall(ServiceCall { service, call, encoding, payload }))
        }
        other => Err(ProtocolFault::UnknownKind(other)),
    }
}

fn take_number(bytes: &[u8]) -> Result<(u32, &[u8]), ProtocolFault> {
    let (number, rest) = bytes.split_first_chunk::<4>().ok_or(ProtocolFault::TooShort)?;
    Ok((u32::from_le_bytes(*number), rest))
}

/// Composes a message of a subscription.
pub(crate) fn compose_data(subscription: u32, stamp_ns: u64, payload: &[u8]) -> Vec<u8> {
    let mut frame = Vec::with_capacity(13 + payload.len());
    frame.push(MESSAGE_DATA);
    frame.extend_from_slice(&subscription.to_le_bytes());
    frame.extend_from_slice(&stamp_ns.to_le_bytes());
    frame.extend_from_slice(payload);
    frame
}

/// Composes the time of the system.
pub(crate) fn compose_time(now_ns: u64) -> Vec<u8> {
    let mut frame = vec![TIME];
    frame.extend_from_slice(&now_ns.to_le_bytes());
    frame
}

/// Composes the answer to a service call.
pub(crate) fn compose_service_response(
    service: u32,
    call: u32,
    encoding: &str,
    payload: &[u8],
) -> Vec<u8> {
    let len = u32::try_from(encoding.len()).unwrap_or(u32::MAX);
    let mut frame = vec![SERVICE_RESPONSE];
    for number in [service, call, len] {
        frame.extend_from_slice(&number.to_le_bytes());
    }
    frame.extend_from_slice(encoding.as_bytes());
    frame.extend_from_slice(payload);
    frame
}

/// Composes the refusal of a service call.
pub(crate) fn compose_service_failure(service: u32, call: u32, message: &str) -> String {
    json!({"op": "serviceCallFailure", "serviceId": service, "callId": call, "message": message})
        .to_string()
}

/// How serious a status is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum StatusLevel {
    Warning = 1,
    Error = 2,
}

/// Composes a message for the person at the viewer. One with the same `id` replaces it.
pub(crate) fn compose_status(level: StatusLevel, id: &str, message: &str) -> String {
    json!({"op": "status", "level": level as u8, "id": id, "message": message}).to_string()
}

/// What a channel is announced with.
#[derive(Clone, Copy, Debug)]
pub(crate) struct AnnouncedChannel<'a> {
    pub(crate) id: u32,
    pub(crate) topic: &'a str,
    pub(crate) schema_name: &'a str,
    pub(crate) schema: &'a str,
}

/// Composes the announcement of channels.
pub(crate) fn compose_advertise<'a>(
    channels: impl Iterator<Item = AnnouncedChannel<'a>>,
) -> String {
    let channels: Vec<_> = channels
        .map(|channel| {
            json!({
                "id": channel.id,
                "topic": channel.topic,
                "encoding": CDR,
                "schemaName": channel.schema_name,
                "schema": channel.schema,
                "schemaEncoding": ROS2_MSG,
            })
        })
        .collect();
    json!({"op": "advertise", "channels": channels}).to_string()
}

/// Composes the end of channels.
pub(crate) fn compose_unadvertise(ids: &[u32]) -> String {
    json!({"op": "unadvertise", "channelIds": ids}).to_string()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn requests_are_read_as_viewers_write_them() {
        let read = |text| read_request(text).expect("it is one");
        let subscriptions = vec![WantedSubscription { id: 0, channel_id: 3 }];
        let text = r#"{"op":"subscribe","subscriptions":[{"id":0,"channelId":3}],"new":1}"#;
        assert_eq!(read(text), ViewerRequest::Subscribe { subscriptions });
        let text = r#"{"op":"getParameters","parameterNames":[],"id":"all"}"#;
        let all = ViewerRequest::GetParameters { parameter_names: vec![], id: Some("all".into()) };
        assert_eq!(read(text), all);
        let text =
            r#"{"op":"setParameters","parameters":[{"name":"a.b","value":3.5},{"name":"c"}]}"#;
        let parameters = vec![
            ParameterChange { name: "a.b".into(), value: Some(json!(3.5)) },
            ParameterChange { name: "c".into(), value: None },
        ];
        assert_eq!(read(text), ViewerRequest::SetParameters { parameters, id: None });
        let graph = read(r#"{"op":"subscribeConnectionGraph"}"#);
        assert_eq!(graph, ViewerRequest::SubscribeConnectionGraph);
        for wrong in ["", "[]", "{}", r#"{"op":"fly"}"#, r#"{"op":"subscribe"}"#, "\u{0}"] {
            assert!(read_request(wrong).is_err(), "{wrong:?}");
        }
    }

    #[test]
    fn frames_are_read_and_short_ones_refused() {
        let frame = [1, 7, 0, 0, 0, 8, 9];
        assert_eq!(
            read_frame(&frame).expect("data"),
            ViewerFrame::Data { channel: 7, payload: &[8, 9] }
        );
        let call = [2, 1, 0, 0, 0, 2, 0, 0, 0, 3, 0, 0, 0, b'c', b'd', b'r', 5];
        let read = ServiceCall { service: 1, call: 2, encoding: CDR, payload: &[5] };
        assert_eq!(read_frame(&call).expect("a call"), ViewerFrame::ServiceCall(read));
        for end in 0..16 {
            assert!(read_frame(&call[..end]).is_err(), "{end} bytes");
        }
        let long = [2, 1, 0, 0, 0, 2, 0, 0, 0, 255, 255, 255, 255];
        assert!(read_frame(&long).is_err(), "a length beyond the message");
        assert!(read_frame(&[9, 0, 0, 0, 0]).is_err());
    }

    #[test]
    fn what_is_composed_has_the_layout_of_the_protocol() {
        assert_eq!(compose_data(2, 3, &[4]), [1, 2, 0, 0, 0, 3, 0, 0, 0, 0, 0, 0, 0, 4]);
        assert_eq!(compose_time(258), [2, 2, 1, 0, 0, 0, 0, 0, 0]);
        let response = compose_service_response(1, 2, CDR, &[7]);
        assert_eq!(response, [3, 1, 0, 0, 0, 2, 0, 0, 0, 3, 0, 0, 0, b'c', b'd', b'r', 7]);
        let status: Value =
            serde_json::from_str(&compose_status(StatusLevel::Warning, "x", "y")).expect("JSON");
        assert_eq!(status, json!({"op": "status", "level": 1, "id": "x", "message": "y"}));
    }
}
