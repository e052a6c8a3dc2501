//! Parameters: all of them, one, and a new value for one.

use std::sync::Arc;
use std::time::Duration;

use armor_sdk::configuration::{
    ConfigdConnection, ConfigdError, ParameterList, Questions, SetOutcome,
};
use armor_wire::config::{FindingRecord, ListedParameter};
use axum::body::Bytes;
use axum::extract::{Path, State};
use axum::http::StatusCode;
use axum::response::Response;
use serde::Deserialize;
use serde_json::{Value, json};

use crate::failure::{WebFailure, json_response};
use crate::remote::caller::Caller;
use crate::system_routes::run_asking;
use crate::web_state::WebState;

/// Time within which the registry and configd must answer.
const FOUND_WITHIN: Duration = Duration::from_secs(3);

/// A new value.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct ValueBody {
    /// As it is written in the file; null for the default.
    value: Option<String>,
}

/// `GET /api/parameters`.
pub(crate) async fn list_parameters(
    State(web): State<Arc<WebState>>,
) -> Result<Response, WebFailure> {
    let list = ask_configd(&web, |configd| configd.parameters(None)).await?;
    let all: Vec<_> = list.parameters.iter().map(describe_parameter).collect();
    let shown = json!({"version": list.version, "refused": list.refused, "parameters": all});
    Ok(json_response(StatusCode::OK, &shown))
}

/// `GET /api/parameters/{component}/{name}`.
pub(crate) async fn show_parameter(
    State(web): State<Arc<WebState>>,
    Path((component, name)): Path<(String, String)>,
) -> Result<Response, WebFailure> {
    let asked = component.clone();
    let list = ask_configd(&web, move |configd| configd.parameters(Some(&asked))).await?;
    let found = find_parameter(&list, &component, &name)?;
    Ok(json_response(StatusCode::OK, &describe_parameter(found)))
}

/// `PUT /api/parameters/{component}/{name}`.
pub(crate) async fn set_parameter(
    State(web): State<Arc<WebState>>,
    Path((component, name)): Path<(String, String)>,
    caller: Caller,
    body: Bytes,
) -> Result<Response, WebFailure> {
    let body: ValueBody = serde_json::from_slice(&body).map_err(|error| {
        let remedy = "send {\"value\": \"0.5m/s\"}, or {\"value\": null} for the default";
        WebFailure::bad(error.to_string(), "the body", remedy)
    })?;
    let place = place_of(&component, &name);
    let what = match &body.value {
        Some(value) => format!("has set {place} to {value:?}"),
        None => format!("has set {place} to its default"),
    };
    let set = move |configd: &mut ConfigdConnection| {
        configd.set(&component, &name, body.value.as_deref())
    };
    match ask_configd(&web, set).await? {
        SetOutcome::Set { version, changes, findings } => {
            caller.log(&what);
            let changes: Vec<_> = changes
                .iter()
                .map(|change| json!({"text": change.text, "effect": change.effect.as_str()}))
                .collect();
            let findings: Vec<_> = findings.iter().map(describe_finding).collect();
            let shown = json!({"version": version, "changes": changes, "findings": findings});
            Ok(json_response(StatusCode::OK, &shown))
        }
        SetOutcome::Rejected { text, findings, .. } => {
            let remedy = findings.first().map_or_else(
                || "GET /api/parameters shows what is allowed".to_owned(),
                |finding| format!("{}: {} {}", finding.code, finding.message, finding.remedy),
            );
            Err(WebFailure::new(StatusCode::CONFLICT, text, place, remedy))
        }
    }
}

async fn ask_configd<R: Send + 'static>(
    web: &Arc<WebState>,
    ask: impl FnOnce(&mut ConfigdConnection) -> Result<R, ConfigdError> + Send + 'static,
) -> Result<R, WebFailure> {
    let work = move |web: &WebState| {
        let from = format!("web-{}", std::process::id());
        ConfigdConnection::open(&web.directory, &from, FOUND_WITHIN)
            .and_then(|mut configd| ask(&mut configd))
    };
    run_asking(web, work).await?.map_err(|error| match error {
        ConfigdError::Refused(refusal) => WebFailure::new(
            StatusCode::CONFLICT,
            refusal.text,
            "configd",
            "GET /api/parameters lists all parameters",
        ),
        error => WebFailure::new(
            StatusCode::BAD_GATEWAY,
            error.to_string(),
            "configd",
            "see with `armor ps` whether configd runs, and try again",
        ),
    })
}

fn find_parameter<'a>(
    list: &'a ParameterList,
    component: &str,
    name: &str,
) -> Result<&'a ListedParameter, WebFailure> {
    let is_it = |it: &&ListedParameter| it.component == component && it.name == name;
    list.parameters.iter().find(is_it).ok_or_else(|| {
        WebFailure::new(
            StatusCode::NOT_FOUND,
            "there is no such parameter",
            place_of(component, name),
            "GET /api/parameters lists all parameters",
        )
    })
}

fn place_of(component: &str, name: &str) -> String {
    format!("parameter `{}.{}`", component.escape_default(), name.escape_default())
}

fn describe_parameter(it: &ListedParameter) -> Value {
    json!({
        "component": it.component,
        "name": it.name,
        "type": it.kind.to_string(),
        "value": it.value,
        "unit": it.unit,
        "origin": it.origin,
        "live": it.live,
        "range": it.range,
        "doc": it.doc,
        "places": it.places,
    })
}

fn describe_finding(finding: &FindingRecord) -> Value {
    json!({"code": finding.code, "message": finding.message, "remedy": finding.remedy})
}
