//! Logging in with an invitation, logging out, and who is logged in. Open to strangers.

use std::sync::Arc;
use std::time::Duration;

use armor_keys::expiry::now_s;
use armor_keys::invitations::{AccessFault, LISTED_S, Secret, Visitor};
use axum::Extension;
use axum::body::Bytes;
use axum::extract::State;
use axum::http::{HeaderMap, HeaderValue, StatusCode, header};
use axum::response::{IntoResponse, Response};
use serde::Deserialize;
use serde_json::{Value, json};

use super::caller::{Caller, describe_stranger};
use super::connection::RemoteConnection;
use super::cookie::{give_session, read_session, take_session};
use super::{LoginFault, RemoteAccess};
use crate::failure::{WebFailure, json_response, text_response};
use crate::system_routes::run_waiting;
use crate::web_state::WebState;

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct LoginBody {
    invite: String,
    /// What this browser has drawn for this login, and sends again if it gets no answer.
    attempt: Option<String>,
    /// Whether another session of this browser may end.
    #[serde(default)]
    replace: bool,
}

/// Returns who sends a request with these headers.
pub(crate) fn identify(remote: &RemoteAccess, headers: &HeaderMap) -> (Caller, Option<Secret>) {
    let Some(session) = read_session(headers) else { return (Caller::Stranger(None), None) };
    match remote.find_visitor(&session) {
        Ok(visitor) => (Caller::Visitor(visitor), Some(session)),
        Err(fault) => (Caller::Stranger(Some(fault)), None),
    }
}

/// `GET /api/session`.
pub(crate) async fn show_session(State(web): State<Arc<WebState>>, caller: Caller) -> Response {
    let mut shown = match &caller {
        Caller::Local => json!({"login": "not needed"}),
        Caller::Visitor(visitor) => describe_visitor(visitor),
        Caller::Stranger(fault) => {
            let problem = fault.filter(|fault| *fault != AccessFault::Unknown);
            let problem =
                problem.map(|_| describe_stranger(*fault).to_json()["error"]["what"].clone());
            // The page writes this time as its clocks do.
            let ended_s = match fault {
                Some(AccessFault::Expired { at_s }) => json!(at_s),
                _ => Value::Null,
            };
            json!({"login": "needed", "problem": problem, "ended_s": ended_s})
        }
    };
    if let Some(remote) = &web.remote {
        shown["host"] = json!(remote.host_name());
        shown["fingerprint"] = json!(remote.fingerprint());
        shown["authority_fingerprint"] = json!(remote.authority_fingerprint());
    }
    json_response(StatusCode::OK, &shown)
}

fn describe_visitor(visitor: &Visitor) -> Value {
    let Visitor { name, role, until_s, .. } = visitor;
    let left_s = until_s.saturating_sub(now_s());
    json!({"login": "done", "name": name, "role": role.name(), "until_s": until_s, "left_s": left_s})
}

/// `POST /api/login`.
pub(crate) async fn log_in(
    State(web): State<Arc<WebState>>,
    caller: Caller,
    connection: Option<Extension<Arc<RemoteConnection>>>,
    headers: HeaderMap,
    body: Bytes,
) -> Result<Response, WebFailure> {
    let understood = serde_json::from_slice(&body).ok().and_then(|body: LoginBody| {
        let attempt = body.attempt.as_deref().map(Secret::from_text);
        // One that is shorter could be guessed by another browser that has the link.
        (attempt != Some(None)).then(|| (attempt.flatten(), body))
    });
    let (attempt, body) = understood.ok_or_else(|| {
        // The reason could have the secret.
        let what = "the body is not understood";
        WebFailure::bad(
            what,
            "the body",
            "send {\"invite\": \"…\"}, what follows #invite= in the link; \"attempt\", if given, is 40 \
             random hexadecimal digits",
        )
    })?;
    let (Some(remote), Some(Extension(connection))) = (web.remote.clone(), connection) else {
        return Err(no_login());
    };
    // A person who opens the link again stays logged in.
    if let Caller::Visitor(visitor) = &caller
        && remote.is_secret_of(&body.invite, visitor.invitation)
    {
        return Ok(json_response(StatusCode::OK, &describe_visitor(visitor)));
    }
    // A link of another person must not end the work of this one by itself.
    if let Caller::Visitor(visitor) = &caller
        && !body.replace
    {
        let Visitor { name, role, .. } = visitor;
        return Err(WebFailure::new(
            StatusCode::CONFLICT,
            format!("this browser is logged in as {name} ({role}); the invitation was not used"),
            "the session",
            "log out first, or send {\"replace\": true} with the invitation",
        ));
    }
    let address = connection.address;
    let before = read_session(&headers);
    let remote_there = Arc::clone(&remote);
    let exchange = move |_: &WebState| {
        let done = remote_there.log_in(&body.invite, attempt.as_ref(), address)?;
        if let Some(before) = before {
            remote_there.log_out(&before)?;
        }
        Ok::<_, LoginFault>(done)
    };
    let (session, visitor) = match run_waiting(&web.logging_in, &web, exchange).await? {
        Ok(done) => done,
        Err(fault) => return Ok(describe_fault(fault)),
    };
    let mut response = json_response(StatusCode::OK, &describe_visitor(&visitor));
    // For longer than the session: the page then learns from the server that it has expired, and when.
    let kept_s = visitor.until_s.saturating_sub(now_s()).max(1).saturating_add(LISTED_S);
    let cookie = give_session(&session, kept_s);
    set_cookie(&mut response, cookie);
    connection.bind(session, &remote);
    Ok(response)
}

/// `POST /api/logout`.
pub(crate) async fn log_out(
    State(web): State<Arc<WebState>>,
    caller: Caller,
    headers: HeaderMap,
) -> Result<Response, WebFailure> {
    let Some(remote) = web.remote.clone() else { return Err(no_login()) };
    if let (Caller::Visitor(_), Some(session)) = (&caller, read_session(&headers)) {
        let ended = run_waiting(&web.logging_in, &web, move |_| remote.log_out(&session)).await?;
        ended.map_err(|error| file_fault(error.to_string()))?;
        caller.log("has logged out");
    }
    let mut response = json_response(StatusCode::OK, &json!({"login": "needed", "problem": null}));
    set_cookie(&mut response, take_session());
    Ok(response)
}

/// `GET /authority.crt`.
pub(crate) async fn show_authority(
    State(web): State<Arc<WebState>>,
) -> Result<Response, WebFailure> {
    let Some(remote) = &web.remote else { return Err(no_login()) };
    let der = remote.authority_certificate();
    Ok(text_response(StatusCode::OK, "application/x-x509-ca-cert", der))
}

fn set_cookie(response: &mut Response, cookie: Option<HeaderValue>) {
    if let Some(cookie) = cookie {
        response.headers_mut().insert(header::SET_COOKIE, cookie);
    }
}

fn no_login() -> WebFailure {
    let what = "this server is on loopback, where no one logs in";
    let remedy = "armor web --listen ADDRESS:PORT serves other hosts, with keys (docs/web.md)";
    WebFailure::new(StatusCode::CONFLICT, what, "this server", remedy)
}

fn describe_fault(fault: LoginFault) -> Response {
    match fault {
        LoginFault::Slowed(wait) => {
            let wait_s = (wait + Duration::from_millis(999)).as_secs();
            let what =
                format!("too many wrong invitations came from this address: wait {wait_s} s");
            let remedy = "check the link; sessions that exist are not affected";
            let failure =
                WebFailure::new(StatusCode::TOO_MANY_REQUESTS, what, "the invitation", remedy);
            let mut response = failure.into_response();
            response.headers_mut().insert(header::RETRY_AFTER, HeaderValue::from(wait_s));
            response
        }
        LoginFault::Refused(fault) => {
            let what = format!("the invitation is not accepted: {fault}");
            let remedy = "ask for another one: on the robot `armor keys invite NAME --role ROLE`";
            WebFailure::new(StatusCode::FORBIDDEN, what, "the invitation", remedy).into_response()
        }
        LoginFault::File(error) => file_fault(error.to_string()).into_response(),
    }
}

fn file_fault(error: String) -> WebFailure {
    tracing::error!("the invitations cannot be changed: {error}");
    let status = StatusCode::INTERNAL_SERVER_ERROR;
    let what = "the robot cannot save its invitations; its log has the reason";
    WebFailure::new(status, what, "the robot", "free the disk or repair the folder of keys")
}
