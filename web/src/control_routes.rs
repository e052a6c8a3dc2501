//! Control of the robot: one client at a time drives it and may release STOP.
//!
//! Control lasts as long as the WebSocket of its holder. The robot moves only while messages arrive
//! on it: after [`DEAD_MAN`] without one, or when the connection ends, a velocity of zero is
//! published.

use std::pin::pin;
use std::sync::Arc;
use std::time::Duration;

use armor_inspect::DEAD_MAN;
use axum::extract::ws::{Message, WebSocket, WebSocketUpgrade};
use axum::extract::{RawQuery, State};
use axum::http::StatusCode;
use axum::response::{IntoResponse, Response};
use serde::Deserialize;
use serde_json::{Value, json};
use tokio::time::{Instant, sleep_until, timeout};

use crate::commands::RobotCommands;
use crate::control_desk::ControlSeat;
use crate::failure::WebFailure;
use crate::live::WEB_SOCKET_LIMIT;
use crate::query::Query;
use crate::remote::caller::Caller;
use crate::web_state::WebState;

/// Time without a message after which control is free again; the page sends one every second.
const SILENCE: Duration = Duration::from_secs(5);
/// Longest time that an answer may take: a client that reads nothing must not delay the dead man.
const ANSWER_WITHIN: Duration = Duration::from_millis(200);
/// A date that does not come, for a robot that stands.
const NEVER: Duration = Duration::from_secs(365 * 24 * 3600);

/// A message of the client in control.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct ControlMessage {
    drive: Option<Velocity>,
    #[serde(default)]
    release: bool,
}

#[derive(Clone, Copy, Deserialize)]
#[serde(deny_unknown_fields)]
struct Velocity {
    forward_mps: f64,
    turn_radps: f64,
}

/// `GET /api/control`.
pub(crate) async fn hold_control(
    State(web): State<Arc<WebState>>,
    caller: Caller,
    RawQuery(query): RawQuery,
    upgrade: WebSocketUpgrade,
) -> Response {
    let is_forced = match Query::read(query.as_deref(), &["take"]).and_then(|it| it.switch("take"))
    {
        Ok(is_forced) => is_forced,
        Err(failure) => return failure.into_response(),
    };
    let Some(seat) = web.control.take(is_forced) else {
        let what = "another client is in control";
        let remedy = "wait until it leaves, or take control with /api/control?take=true";
        let status = StatusCode::CONFLICT;
        return WebFailure::new(status, what, "/api/control", remedy).into_response();
    };
    let upgrade = upgrade.max_message_size(WEB_SOCKET_LIMIT).max_frame_size(WEB_SOCKET_LIMIT);
    upgrade.on_upgrade(move |socket| serve_control(web, caller, seat, socket))
}

async fn serve_control(
    web: Arc<WebState>,
    caller: Caller,
    seat: ControlSeat,
    mut socket: WebSocket,
) {
    caller.log("takes control");
    let mut driver = ManualDriver { commands: web.commands.clone(), moves_until: None };
    let hello = json!({
        "control": seat.token,
        "drive": web.drive_limits(),
        "dead_man_s": DEAD_MAN.as_secs_f64(),
    });
    if !send_answer(&mut socket, &hello).await {
        return;
    }
    let mut heard = Instant::now();
    loop {
        let stops_at = driver.moves_until.unwrap_or_else(|| Instant::now() + NEVER);
        let message = tokio::select! {
            // In this order: a robot that must stop does not wait for messages that arrive.
            biased;
            () = sleep_until(stops_at) => {
                driver.halt();
                continue;
            }
            () = seat.replaced.notified() => {
                driver.halt();
                send_answer(&mut socket, &loss_of_control()).await;
                return;
            }
            () = sleep_until(heard + SILENCE) => return,
            message = socket.recv() => message,
        };
        heard = Instant::now();
        let answer = match message {
            Some(Ok(Message::Text(text))) => match take_message(&web, &mut driver, &text) {
                Ok(TakenMessage::Driven) => continue,
                Ok(TakenMessage::Release) => release_stop(&web, &caller, &seat, &mut socket).await,
                Err(failure) => Some(failure.to_json()),
            },
            Some(Ok(Message::Ping(_) | Message::Pong(_) | Message::Binary(_))) => continue,
            Some(Ok(Message::Close(_)) | Err(_)) | None => return,
        };
        let Some(answer) = answer else { return };
        if !send_answer(&mut socket, &answer).await {
            return;
        }
        heard = Instant::now();
    }
}

/// Releases STOP and returns the answer; none if the client leaves or loses control before, which ends a
/// release that still waits. Messages that arrive meanwhile have no effect: a second release would be
/// sent long after the button was pressed, and a velocity long after the stick was moved.
async fn release_stop(
    web: &WebState,
    caller: &Caller,
    seat: &ControlSeat,
    socket: &mut WebSocket,
) -> Option<Value> {
    let mut releasing = pin!(web.stop.release(caller.name()));
    loop {
        tokio::select! {
            biased;
            released = &mut releasing => {
                return Some(released.unwrap_or_else(|failure| failure.to_json()));
            }
            () = seat.replaced.notified() => {
                send_answer(socket, &loss_of_control()).await;
                return None;
            }
            message = socket.recv() => {
                if let Some(Ok(Message::Close(_)) | Err(_)) | None = message {
                    return None;
                }
            }
        }
    }
}

fn loss_of_control() -> Value {
    json!({"lost": "another client has taken control"})
}

/// Returns whether the client has taken the answer.
async fn send_answer(socket: &mut WebSocket, answer: &Value) -> bool {
    let sending = socket.send(Message::text(answer.to_string()));
    matches!(timeout(ANSWER_WITHIN, sending).await, Ok(Ok(())))
}

/// What a message has left to be done.
enum TakenMessage {
    /// Nothing: its velocity, if it had one, is published.
    Driven,
    /// STOP is to be released.
    Release,
}

fn take_message(
    web: &WebState,
    driver: &mut ManualDriver,
    text: &str,
) -> Result<TakenMessage, WebFailure> {
    let message: ControlMessage = serde_json::from_str(text).map_err(|error| {
        let remedy = "send {\"drive\": {\"forward_mps\": 0.1, \"turn_radps\": 0}} or \
                      {\"release\": true}";
        WebFailure::bad(error.to_string(), "the message", remedy)
    })?;
    if let Some(velocity) = message.drive {
        driver.drive(web.stop.is_stopped(web.is_paused()), velocity)?;
    }
    if !message.release {
        return Ok(TakenMessage::Driven);
    }
    // The robot must not start to move by a stick that is held.
    driver.halt();
    Ok(TakenMessage::Release)
}

/// Publishes velocities; zero when it is dropped while the robot moves.
struct ManualDriver {
    commands: Option<Arc<dyn RobotCommands>>,
    /// When the robot must stop, if it moves.
    moves_until: Option<Instant>,
}

impl ManualDriver {
    fn drive(&mut self, is_stopped: bool, velocity: Velocity) -> Result<(), WebFailure> {
        let refuse = |what: &str, remedy: &str| {
            Err(WebFailure::new(StatusCode::CONFLICT, what, "the field `drive`", remedy))
        };
        let Some(commands) = self.commands.clone() else {
            return refuse(
                "this program cannot drive the robot",
                "give the system a component of kind `web-view`, whose page can (docs/web.md)",
            );
        };
        let Velocity { forward_mps, turn_radps } = velocity;
        let Some((forward_mps, turn_radps)) = commands.limits().clamp(forward_mps, turn_radps)
        else {
            self.halt();
            return refuse("a velocity must be a number", "send metres and radians per second");
        };
        if forward_mps == 0.0 && turn_radps == 0.0 {
            self.halt();
            return Ok(());
        }
        if is_stopped {
            self.halt();
            return refuse("STOP is in force", "release it first");
        }
        self.moves_until = Some(Instant::now() + DEAD_MAN);
        match commands.drive(forward_mps, turn_radps) {
            Ok(0) => refuse(
                "no component takes the velocity",
                "link it: <link from=\"web.velocity\" to=\"driver.manual\"/>",
            ),
            Ok(_) => Ok(()),
            Err(error) => refuse(&error, "`armor ps` shows the components"),
        }
    }

    /// Publishes zero, once; then nothing, so that the path of a mission is followed again.
    fn halt(&mut self) {
        if self.moves_until.take().is_some()
            && let Some(commands) = &self.commands
            && let Err(error) = commands.drive(0.0, 0.0)
        {
            // The driver stops by its own timeout.
            tracing::warn!("a velocity of zero was not published: {error}");
        }
    }
}

impl Drop for ManualDriver {
    fn drop(&mut self) {
        self.halt();
    }
}
