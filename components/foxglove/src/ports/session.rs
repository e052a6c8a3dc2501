//! One client: its handshake, its requests, and what is sent to it.

use std::collections::BTreeMap;
use std::sync::Arc;
use std::time::Duration;

use armor_wire::acting::{KeyRole, NeedsRole};
use armor_wire::config::ConfigRequest;
use futures_util::stream::{SplitSink, SplitStream};
use futures_util::{SinkExt, StreamExt};
use serde_json::{Value, json};
use tokio::net::TcpStream;
use tokio::time::{interval, timeout};
use tokio_tungstenite::tungstenite::handshake::server::{ErrorResponse, Request, Response};
use tokio_tungstenite::tungstenite::http::{HeaderMap, HeaderValue, StatusCode, header};
use tokio_tungstenite::tungstenite::protocol::WebSocketConfig;
use tokio_tungstenite::tungstenite::{Error, Message};
use tokio_tungstenite::{WebSocketStream, accept_hdr_async_with_config};

use super::bridge::{Bridge, ConnectedClient};
use super::channel::to_nanoseconds;
use super::mission_services::{MissionService, compose_services};
use super::parameter_desk::set_parameters;
use super::published_message::PublishedChannel;
use crate::outbox::OutgoingMessage;
use crate::viewer_handshake::{HandshakeHeaders, check_handshake};
use crate::viewer_protocol::{
    CDR, ClientChannel, JSON, ParameterChange, ServiceCall, StatusLevel, ViewerFrame,
    ViewerRequest, compose_service_failure, compose_service_response, compose_status, compose_time,
    read_frame, read_request,
};

/// Time within which a client sends its handshake.
const HANDSHAKE_WITHIN: Duration = Duration::from_secs(10);
/// Longest message of a client, in bytes.
const MAX_MESSAGE_LEN: usize = 256 << 10;
/// Topics that a client may subscribe to.
const MAX_SUBSCRIPTIONS: usize = 512;
/// Topics that a client may publish on.
const MAX_PUBLISHED: usize = 64;
/// Parameters whose changes a client may subscribe to by name.
const MAX_PARAMETERS: usize = 4096;
/// Time within which a client must take a message.
const TAKEN_WITHIN: Duration = Duration::from_secs(20);
/// Time between two messages with the time of the system, if there is no data.
const TIME_EVERY: Duration = Duration::from_millis(50);
/// Time between two warnings of a client that it reads too slowly.
const WARN_EVERY: Duration = Duration::from_secs(5);

/// The topics that a client publishes by their numbers, or why they are not taken.
type ClientChannels = BTreeMap<u32, Result<PublishedChannel, String>>;
type Writer = SplitSink<WebSocketStream<TcpStream>, Message>;
type Reader = SplitStream<WebSocketStream<TcpStream>>;

/// Serves a connection from its first byte to its end.
///
/// # Errors
/// In words, if the handshake fails.
pub(super) async fn serve_client(
    bridge: Arc<Bridge>,
    stream: TcpStream,
    address: String,
    origins: Arc<[String]>,
) -> Result<(), String> {
    let config = WebSocketConfig::default()
        .max_message_size(Some(MAX_MESSAGE_LEN))
        .max_frame_size(Some(MAX_MESSAGE_LEN))
        .read_buffer_size(16 << 10)
        .write_buffer_size(0);
    #[expect(clippy::result_large_err, reason = "the handshake's own type")]
    let answer = move |request: &Request, response| answer_handshake(request, response, &origins);
    let handshake = accept_hdr_async_with_config(stream, answer, Some(config));
    let socket = match timeout(HANDSHAKE_WITHIN, handshake).await {
        Ok(Ok(socket)) => socket,
        Ok(Err(Error::Http(response))) => {
            let text = response.body().as_deref().map(String::from_utf8_lossy);
            return Err(text.unwrap_or_default().into_owned());
        }
        Ok(Err(error)) => return Err(error.to_string()),
        Err(_) => return Err("it has sent no handshake".into()),
    };
    let server_info = compose_server_info(bridge.commander.role());
    let client = bridge.admit(address, server_info, compose_services());
    tracing::info!("viewer {} at {}", client.id, client.address);
    let session = Arc::new(ViewerSession { bridge, client });
    let (writer, reader) = socket.split();
    tokio::select! {
        () = session.write_messages(writer) => {}
        () = session.read_requests(reader) => {}
    }
    Ok(())
}

#[expect(clippy::result_large_err, reason = "the handshake's own type")]
fn answer_handshake(
    request: &Request,
    mut response: Response,
    origins: &[String],
) -> Result<Response, ErrorResponse> {
    let list = |name: header::HeaderName| list_values(request.headers(), &name);
    let headers = HandshakeHeaders {
        host: list(header::HOST),
        origin: list(header::ORIGIN),
        protocols: list(header::SEC_WEBSOCKET_PROTOCOL),
    };
    match check_handshake(&headers, origins) {
        Ok(protocol) => {
            let chosen = HeaderValue::from_static(protocol);
            response.headers_mut().insert(header::SEC_WEBSOCKET_PROTOCOL, chosen);
            Ok(response)
        }
        Err(refusal) => {
            let mut refused = ErrorResponse::new(Some(refusal.to_string()));
            *refused.status_mut() = StatusCode::FORBIDDEN;
            Err(refused)
        }
    }
}

fn list_values(headers: &HeaderMap, name: &header::HeaderName) -> Vec<String> {
    let values = headers.get_all(name).iter();
    // One that is no text is refused as unknown.
    values.map(|value| value.to_str().unwrap_or("\u{fffd}").to_owned()).collect()
}

fn compose_server_info(role: KeyRole) -> String {
    let mut capabilities =
        vec!["time", "parameters", "parametersSubscribe", "connectionGraph", "services"];
    // STOP may be published in any role.
    capabilities.push("clientPublish");
    json!({
        "op": "serverInfo",
        "name": format!("Armor {}, role {role}", env!("CARGO_PKG_VERSION")),
        "capabilities": capabilities,
        "supportedEncodings": [CDR, JSON],
        // Viewers that know it have the definitions of the standard messages of ROS 2, with which
        // they publish.
        "metadata": {"ROS_DISTRO": "humble"},
        "sessionId": std::process::id().to_string(),
    })
    .to_string()
}

struct ViewerSession {
    bridge: Arc<Bridge>,
    client: Arc<ConnectedClient>,
}

impl Drop for ViewerSession {
    fn drop(&mut self) {
        self.bridge.dismiss(&self.client);
        let counts = self.client.outbox.counts();
        let (id, sent, dropped) = (self.client.id, counts.sent, counts.dropped);
        tracing::info!("viewer {id} has left: {sent} messages sent, {dropped} dropped");
    }
}

impl ViewerSession {
    /// Sends what waits for the client, until it is gone or takes nothing.
    async fn write_messages(&self, mut writer: Writer) {
        let mut ticks = interval(TIME_EVERY);
        let mut last_ns = 0;
        let (mut warned, mut warned_of) = (None::<tokio::time::Instant>, 0);
        loop {
            let (outgoing, is_data) = tokio::select! {
                next = self.client.outbox.take() => match next {
                    Some((outgoing, stamp_ns)) => (Some(outgoing), stamp_ns.is_some()),
                    None => return tracing::warn!("viewer {} takes no answers", self.client.id),
                },
                _ = ticks.tick() => (None, true),
            };
            // The viewer's time follows: it must be there before the data of that time.
            let now_ns = to_nanoseconds(self.bridge.commander.timestamp());
            if is_data && now_ns != last_ns && now_ns > 0 {
                last_ns = now_ns;
                if !send(&mut writer, Message::binary(compose_time(now_ns))).await {
                    return;
                }
            }
            let message = match outgoing {
                Some(OutgoingMessage::Text(text)) => Message::text(text),
                Some(OutgoingMessage::Binary(bytes)) => Message::binary(bytes),
                None => continue,
            };
            if !send(&mut writer, message).await {
                return;
            }
            let dropped = self.client.outbox.counts().dropped;
            if dropped > warned_of && warned.is_none_or(|at| at.elapsed() >= WARN_EVERY) {
                (warned, warned_of) = (Some(tokio::time::Instant::now()), dropped);
                let text = format!(
                    "this viewer reads too slowly: {dropped} messages were dropped for it; \
                     subscribe to fewer or smaller topics"
                );
                self.inform(StatusLevel::Warning, "dropped", &text);
            }
        }
    }

    /// Carries out what the client requests, until it is gone.
    async fn read_requests(self: &Arc<Self>, mut reader: Reader) {
        let mut published = ClientChannels::new();
        while let Some(message) = reader.next().await {
            let handled = match message {
                Ok(Message::Text(text)) => match read_request(&text) {
                    Ok(request) => self.handle_request(request, &mut published),
                    Err(fault) => Err(fault.to_string()),
                },
                Ok(Message::Binary(bytes)) => match read_frame(&bytes) {
                    Ok(ViewerFrame::Data { channel, payload }) => {
                        self.handle_data(published.get(&channel), channel, payload)
                    }
                    Ok(ViewerFrame::ServiceCall(call)) => {
                        self.handle_call(&call);
                        Ok(())
                    }
                    Err(fault) => Err(fault.to_string()),
                },
                Ok(Message::Ping(_) | Message::Pong(_) | Message::Frame(_)) => Ok(()),
                Ok(Message::Close(_)) | Err(_) => return,
            };
            if let Err(text) = handled {
                self.inform(StatusLevel::Error, "request", &text);
            }
        }
    }

    fn inform(&self, level: StatusLevel, id: &str, text: &str) {
        self.client.inform(compose_status(level, id, text));
    }

    fn handle_request(
        self: &Arc<Self>,
        request: ViewerRequest,
        published: &mut ClientChannels,
    ) -> Result<(), String> {
        match request {
            ViewerRequest::Subscribe { subscriptions } => {
                subscriptions.iter().try_for_each(|wanted| {
                    if self.client.interests.lock().subscriptions.len() >= MAX_SUBSCRIPTIONS {
                        return Err(format!(
                            "a viewer has at most {MAX_SUBSCRIPTIONS} subscriptions"
                        ));
                    }
                    self.bridge.subscribe(&self.client, wanted.id, wanted.channel_id)
                })
            }
            ViewerRequest::Unsubscribe { subscription_ids } => {
                subscription_ids.iter().for_each(|id| self.bridge.unsubscribe(&self.client, *id));
                Ok(())
            }
            ViewerRequest::Advertise { channels } => accept_channels(&channels, published),
            ViewerRequest::Unadvertise { channel_ids } => {
                channel_ids.iter().for_each(|id| drop(published.remove(id)));
                Ok(())
            }
            ViewerRequest::GetParameters { parameter_names, id } => {
                self.answer_parameters(parameter_names, Vec::new(), id)
            }
            ViewerRequest::SetParameters { parameters, id } => {
                let names = parameters.iter().map(|change| change.name.clone()).collect();
                self.answer_parameters(names, parameters, id)
            }
            ViewerRequest::SubscribeParameterUpdates { parameter_names } => {
                let mut interests = self.client.interests.lock();
                interests.wants_all_parameters |= parameter_names.is_empty();
                interests.parameters.extend(parameter_names);
                if interests.parameters.len() > MAX_PARAMETERS {
                    interests.parameters.clear();
                    return Err(format!("a viewer follows at most {MAX_PARAMETERS} parameters"));
                }
                Ok(())
            }
            ViewerRequest::UnsubscribeParameterUpdates { parameter_names } => {
                let mut interests = self.client.interests.lock();
                if parameter_names.is_empty() {
                    interests.wants_all_parameters = false;
                    interests.parameters.clear();
                }
                interests.parameters.retain(|name| !parameter_names.contains(name));
                Ok(())
            }
            ViewerRequest::SubscribeConnectionGraph => {
                self.client.interests.lock().graph.get_or_insert_default();
                self.bridge.update_graphs();
                Ok(())
            }
            ViewerRequest::UnsubscribeConnectionGraph => {
                self.client.interests.lock().graph = None;
                Ok(())
            }
        }
    }

    fn handle_data(
        &self,
        channel: Option<&Result<PublishedChannel, String>>,
        id: u32,
        payload: &[u8],
    ) -> Result<(), String> {
        let channel = channel.ok_or_else(|| format!("there is no channel {id} of this viewer"))?;
        let channel = channel.as_ref().map_err(Clone::clone)?;
        self.bridge.commander.take_message(self.client.id, channel.read(payload)?)
    }

    /// Sets parameters, if there are changes, and answers with the values of those named.
    fn answer_parameters(
        self: &Arc<Self>,
        names: Vec<String>,
        changes: Vec<ParameterChange>,
        id: Option<String>,
    ) -> Result<(), String> {
        let is_change = !changes.is_empty();
        if is_change {
            let text = String::new;
            let request = ConfigRequest::Set {
                request: 1,
                component: text(),
                parameter: text(),
                value: None,
            };
            self.bridge.commander.check_role(request.needed_role(), "setting a parameter")?;
        }
        let session = Arc::clone(self);
        self.ask(move || {
            let bridge = &session.bridge;
            // What was set is in the answer, also if something else was not.
            let set = if is_change { set_parameters(bridge.directory(), &changes) } else { Ok(()) };
            if let Err(fault) = set {
                session.inform(StatusLevel::Error, "parameters", &fault);
            }
            match bridge.read_parameters(&names) {
                Ok(values) if !is_change || id.is_some() => {
                    session.client.inform(compose_parameters(&values, id.as_deref()));
                }
                Ok(_) => {}
                Err(fault) => session.inform(StatusLevel::Error, "parameters", &fault),
            }
            if is_change {
                bridge.update_parameters();
            }
        })
    }

    fn handle_call(self: &Arc<Self>, call: &ServiceCall<'_>) {
        let (service, number) = (call.service, call.call);
        let fail = move |session: &Self, text: &str| {
            session.client.inform(compose_service_failure(service, number, text));
        };
        let read = MissionService::numbered(service)
            .ok_or_else(|| format!("there is no service {service}"))
            .and_then(|service| service.read_call(call))
            .and_then(|call| {
                let (role, what) = call.needed_role();
                self.bridge.commander.check_role(role, &what).map(|()| call)
            });
        let order = match read {
            Ok(order) => order,
            Err(text) => return fail(self, &text),
        };
        let (session, encoding) = (Arc::clone(self), call.encoding.to_owned());
        let asked = self.ask(move || {
            let result = order.carry_out(&mut session.bridge.operator.lock());
            match result {
                Ok(payload) => {
                    let frame = compose_service_response(service, number, &encoding, &payload);
                    session.client.outbox.push_answer(OutgoingMessage::Binary(frame));
                }
                Err(text) => fail(&session, &text),
            }
        });
        if let Err(text) = asked {
            fail(self, &text);
        }
    }

    /// Runs work that waits for a process of the system, on a thread for it. Only a few run at the
    /// same time: a process that hangs must not take all threads.
    fn ask(self: &Arc<Self>, work: impl FnOnce() + Send + 'static) -> Result<(), String> {
        if self.bridge.asking.try_acquire().map(|permit| permit.forget()).is_err() {
            return Err("too many requests wait for an answer: try again".into());
        }
        let session = Arc::clone(self);
        tokio::task::spawn_blocking(move || {
            work();
            session.bridge.asking.add_permits(1);
        });
        Ok(())
    }
}

async fn send(writer: &mut Writer, message: Message) -> bool {
    matches!(timeout(TAKEN_WITHIN, writer.send(message)).await, Ok(Ok(())))
}

/// Notes the channels of a client. Viewers announce topics on which they may never publish, such as
/// `/clicked_point`: one that is unknown here is an error only with its first message.
fn accept_channels(
    channels: &[ClientChannel],
    published: &mut ClientChannels,
) -> Result<(), String> {
    for channel in channels {
        if published.len() >= MAX_PUBLISHED {
            return Err(format!("a viewer publishes at most {MAX_PUBLISHED} topics"));
        }
        published.insert(channel.id, PublishedChannel::accept(channel));
    }
    Ok(())
}

fn compose_parameters(values: &[Value], id: Option<&str>) -> String {
    let mut answer = json!({"op": "parameterValues", "parameters": values});
    if let Some(id) = id {
        answer["id"] = id.into();
    }
    answer.to_string()
}
