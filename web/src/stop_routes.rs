//! STOP over HTTP and WebSocket. The thread for STOP serves these routes and no others.

use std::sync::Arc;
use std::time::Duration;

use axum::body::Bytes;
use axum::extract::ws::{Message, WebSocket, WebSocketUpgrade};
use axum::extract::{Request, State};
use axum::http::{HeaderValue, StatusCode, header};
use axum::middleware::Next;
use axum::response::{IntoResponse, Response};
use serde::Deserialize;
use serde_json::{Value, json};

use crate::failure::{WebFailure, json_response};
use crate::live::WEB_SOCKET_LIMIT;
use crate::remote::caller::Caller;
use crate::web_state::WebState;

/// Longest time without a message of a page that is open: it sends one every second.
const SILENCE: Duration = Duration::from_secs(30);

/// A message on the WebSocket for STOP.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct StopMessage {
    #[serde(default)]
    stop: bool,
    /// Returned in the answer.
    #[serde(default)]
    id: u64,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct ReleaseBody {
    control: String,
}

/// `POST /api/stop`.
pub(crate) async fn stop(State(web): State<Arc<WebState>>, caller: Caller) -> Response {
    match web.stop.stop(caller.name(), || web.has_executive()).await {
        Ok(done) => json_response(StatusCode::OK, &done),
        Err(failure) => failure.into_response(),
    }
}

/// `GET /api/stop`.
pub(crate) async fn show_stop(State(web): State<Arc<WebState>>) -> Response {
    json_response(StatusCode::OK, &web.stop.to_json(web.is_paused()))
}

/// `POST /api/stop/release`.
pub(crate) async fn release(
    State(web): State<Arc<WebState>>,
    caller: Caller,
    body: Bytes,
) -> Response {
    let body: ReleaseBody = match serde_json::from_slice(&body) {
        Ok(body) => body,
        Err(error) => {
            let remedy = "send {\"control\": TOKEN}; GET /api/control opens the WebSocket that \
                          has it";
            return WebFailure::bad(error.to_string(), "the body", remedy).into_response();
        }
    };
    if !web.control.is_holder(&body.control) {
        let remedy = "take control over the WebSocket /api/control first";
        let what = "only the client in control may release STOP";
        let status = StatusCode::FORBIDDEN;
        return WebFailure::new(status, what, "the field `control`", remedy).into_response();
    }
    match web.stop.release(caller.name()).await {
        Ok(done) => json_response(StatusCode::OK, &done),
        Err(failure) => failure.into_response(),
    }
}

/// `GET /api/stop/live`: a connection that is ready before STOP is needed.
pub(crate) async fn hold_stop(
    State(web): State<Arc<WebState>>,
    caller: Caller,
    upgrade: WebSocketUpgrade,
) -> Response {
    let upgrade = upgrade.max_message_size(WEB_SOCKET_LIMIT).max_frame_size(WEB_SOCKET_LIMIT);
    upgrade.on_upgrade(move |socket| serve_stop(web, caller, socket))
}

async fn serve_stop(web: Arc<WebState>, caller: Caller, mut socket: WebSocket) {
    while let Ok(Some(Ok(message))) = tokio::time::timeout(SILENCE, socket.recv()).await {
        let answer = match message {
            Message::Text(text) => answer_message(&web, &caller, &text).await,
            Message::Close(_) => return,
            Message::Binary(_) | Message::Ping(_) | Message::Pong(_) => continue,
        };
        if socket.send(Message::text(answer.to_string())).await.is_err() {
            return;
        }
    }
}

async fn answer_message(web: &WebState, caller: &Caller, text: &str) -> Value {
    match serde_json::from_str::<StopMessage>(text) {
        Ok(StopMessage { stop: true, id }) => {
            let stopping = web.stop.stop(caller.name(), || web.has_executive());
            let mut answer = stopping.await.unwrap_or_else(|failure| failure.to_json());
            answer["id"] = json!(id);
            answer
        }
        Ok(StopMessage { stop: false, id }) => {
            json!({"id": id, "state": web.stop.to_json(web.is_paused())})
        }
        Err(error) => {
            WebFailure::bad(error.to_string(), "the message", "send {\"stop\": true}").to_json()
        }
    }
}

/// Ends a connection of the thread for STOP after its response: a browser would send other requests
/// over it, which this thread does not serve.
pub(crate) async fn end_connection(request: Request, next: Next) -> Response {
    let mut response = next.run(request).await;
    if response.status() != StatusCode::SWITCHING_PROTOCOLS {
        response.headers_mut().insert(header::CONNECTION, HeaderValue::from_static("close"));
    }
    response
}
