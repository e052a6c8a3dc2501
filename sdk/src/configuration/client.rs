//! A component's connection to configd: asks how it is connected and what its parameters are, and
//! asks again after every reconnect.

use std::sync::{Arc, mpsc};
use std::time::Duration;

use armor_wire::backoff::Backoff;
use armor_wire::codec;
use armor_wire::config::{ComponentSettings, ConfigReply, ConfigRequest};
use armor_wire::frame::{Frame, FrameKind};
use armor_wire::hello::{Hello, Purpose};

use super::connection::CONFIGD;
use crate::background_thread::spawn_background;
use crate::dial;
use crate::participant::Participant;
use crate::session::{self, FrameWriter};

/// How long the registry may take to find configd before the attempt counts as failed.
const FIND_LIMIT: Duration = Duration::from_secs(5);
/// First and longest delay between two attempts to connect.
const RETRY: (Duration, Duration) = (Duration::from_millis(20), Duration::from_secs(1));

/// Keeps a connection to configd on a thread of its own. Returns where the settings arrive.
pub(crate) fn start_client(
    participant: &Arc<Participant>,
) -> std::io::Result<mpsc::Receiver<Result<ComponentSettings, String>>> {
    let (sender, receiver) = mpsc::channel();
    participant.parameters.lock_state().settings = Some(sender);
    let participant = Arc::clone(participant);
    spawn_background("configd", move || stay_connected(&participant))?;
    Ok(receiver)
}

fn stay_connected(participant: &Participant) {
    // Another seed than that of the process's other reconnects, so that they do not coincide.
    let mut backoff = Backoff::new(RETRY.0, RETRY.1, participant.identity.instance ^ 1);
    while !participant.lifecycle.is_ending() {
        match serve_connection(participant) {
            Ok(()) => backoff.reset(),
            Err(problem) => participant.parameters.lock_state().problem = problem,
        }
        std::thread::sleep(backoff.delay());
    }
}

/// Connects and serves the connection until it ends.
fn serve_connection(participant: &Participant) -> Result<(), String> {
    let found = participant
        .directory()
        .find_process(CONFIGD, FIND_LIMIT)
        .map_err(|error| error.to_string())?;
    let identity = &participant.identity;
    let hello = Hello::new(&identity.name, identity.instance, Purpose::Config);
    let dialled = dial::dial(&found.endpoint, &hello).map_err(|error| error.to_string())?;
    let writer = FrameWriter::new(&dialled.stream).map_err(|error| error.to_string())?;
    repeat_questions(participant, writer.clone());
    let reason = session::serve_frames(
        dialled,
        &writer,
        |frame| receive_reply(participant, frame),
        || Duration::MAX,
    );
    let mut state = participant.parameters.lock_state();
    state.writer = None;
    state.problem = format!("the connection to configd ended: {reason}");
    if !participant.lifecycle.is_ending() {
        tracing::warn!("{}", state.problem);
    }
    Ok(())
}

/// Asks on a new connection what has no answer yet.
fn repeat_questions(participant: &Participant, writer: FrameWriter) {
    let parameters = &participant.parameters;
    let mut state = parameters.lock_state();
    state.writer = Some(writer);
    state.problem.clear();
    state.requests.clear();
    if state.settings.is_some() {
        state.send_request(None, |request| ConfigRequest::Settings { request });
    }
    let asked = state.asked.clone();
    // Live parameters too: a restarted configd does not know which components to inform of changes.
    let is_live = |name: &&String| parameters.declaration(name).is_some_and(|known| known.live);
    let again = state.own.keys().filter(is_live).filter(|name| !asked.contains(name)).cloned();
    for name in again.chain(asked.iter().cloned()).collect::<Vec<_>>() {
        state.send_parameter(&name);
    }
}

fn receive_reply(participant: &Participant, frame: &Frame<'_>) -> Result<(), String> {
    if frame.kind != FrameKind::Control {
        return Err(format!("a {:?} frame from configd", frame.kind));
    }
    let parameters = &participant.parameters;
    match codec::decode_control(frame.body).map_err(|error| error.to_string())? {
        ConfigReply::Settings { request, settings } => {
            let mut state = parameters.lock_state();
            state.requests.remove(&request);
            if let Some(waiting) = state.settings.take() {
                let _ = waiting.send(Ok(settings));
            }
        }
        ConfigReply::Parameter { request, name, assigned } => {
            parameters.lock_state().requests.remove(&request);
            parameters.accept_answer(&name, assigned.as_ref());
        }
        ConfigReply::Refused { request, refusal } => {
            let mut state = parameters.lock_state();
            match state.requests.remove(&request) {
                Some(Some(name)) => {
                    drop(state);
                    parameters.accept_refusal(&name, &refusal.text);
                }
                Some(None) => {
                    if let Some(waiting) = state.settings.take() {
                        let _ = waiting.send(Err(refusal.to_string()));
                    }
                }
                None => tracing::error!("configd refuses what was not asked: {refusal}"),
            }
        }
        ConfigReply::Beat => {}
        ConfigReply::Listed { .. }
        | ConfigReply::Set { .. }
        | ConfigReply::Rejected { .. }
        | ConfigReply::Differences { .. } => return Err("an answer to what only tools ask".into()),
    }
    Ok(())
}
