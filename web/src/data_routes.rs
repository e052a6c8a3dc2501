//! The data of one output: its newest value, a stream of values, and its image.

use std::convert::Infallible;
use std::sync::Arc;
use std::time::Duration;

use axum::extract::{Path, RawQuery, State};
use axum::http::{HeaderName, HeaderValue, StatusCode};
use axum::response::sse::{Event, KeepAlive, Sse};
use axum::response::{IntoResponse, Response};
use futures_util::stream;
use serde_json::json;
use tokio::sync::watch;
use tokio::time::{Instant, sleep_until, timeout};

use crate::data_hub::{ChannelLook, Sample};
use crate::failure::{WebFailure, text_response};
use crate::live::{MAX_HZ, MIN_HZ};
use crate::query::Query;
use crate::system_routes::run_asking;
use crate::web_state::WebState;

/// How long a request waits for the first value by default, in seconds.
const WAIT_S: f64 = 2.0;
/// The longest wait, in seconds.
const MAX_WAIT_S: f64 = 10.0;
/// The rate of a stream by default.
const STREAM_HZ: f64 = 10.0;
/// Time between two comments on a stream without values, by which a dead client is noticed.
const KEEP_ALIVE: Duration = Duration::from_secs(10);

/// `GET /api/data/{name}`.
pub(crate) async fn show_value(
    State(web): State<Arc<WebState>>,
    Path(name): Path<String>,
    RawQuery(query): RawQuery,
) -> Result<Response, WebFailure> {
    let sample = wait_for_sample(&web, &name, query.as_deref()).await?;
    let shown = run_asking(&web, move |_| describe_sample(&name, &sample)).await??;
    Ok(text_response(StatusCode::OK, "application/json", shown))
}

/// `GET /api/data/{name}/image`.
pub(crate) async fn show_image(
    State(web): State<Arc<WebState>>,
    Path(name): Path<String>,
    RawQuery(query): RawQuery,
) -> Result<Response, WebFailure> {
    let sample = wait_for_sample(&web, &name, query.as_deref()).await?;
    let render = move |_: &WebState| {
        let image = sample.image().map_err(|error| {
            let remedy = "GET /api/data marks the outputs that have an image";
            WebFailure::new(StatusCode::UNSUPPORTED_MEDIA_TYPE, error, place_of(&name), remedy)
        })?;
        let mut response = text_response(StatusCode::OK, image.content_type, image.bytes.clone());
        let mut set = |header: &'static str, value: String| {
            if let Ok(value) = HeaderValue::from_str(&value) {
                response.headers_mut().insert(HeaderName::from_static(header), value);
            }
        };
        set("armor-stamp", sample.data.header.stamp_s.to_string());
        set("armor-sequence", sample.data.header.sequence.to_string());
        set("armor-place", image.place.to_string());
        Ok(response)
    };
    run_asking(&web, render).await?
}

/// `GET /api/data/{name}/stream`.
pub(crate) async fn stream_values(
    State(web): State<Arc<WebState>>,
    Path(name): Path<String>,
    RawQuery(query): RawQuery,
) -> Result<Response, WebFailure> {
    let query = Query::read(query.as_deref(), &["max_hz"])?;
    let max_hz = query.number("max_hz", STREAM_HZ, MIN_HZ, MAX_HZ)?;
    let mut looks = web.hub.follow(&name)?;
    looks.mark_changed();
    let period = Duration::from_secs_f64(1.0 / max_hz);
    let state = (looks, Instant::now(), name);
    let events = stream::unfold(state, move |(mut looks, due, name)| async move {
        looks.changed().await.ok()?;
        // A client that is slow, or wants fewer, gets the newest when it is ready.
        sleep_until(due).await;
        let look = looks.borrow_and_update().clone();
        let event = describe_event(&name, &look);
        let next_due = Instant::now() + period;
        Some((Ok::<_, Infallible>(event), (looks, next_due, name)))
    });
    Ok(Sse::new(events).keep_alive(KeepAlive::new().interval(KEEP_ALIVE)).into_response())
}

fn describe_event(name: &str, look: &ChannelLook) -> Event {
    let shown = match &look.sample {
        Some(sample) if look.problem.is_empty() => describe_sample(name, sample),
        _ if look.problem.is_empty() => return Event::default().comment("no value yet"),
        _ => Err(missing(name, &look.problem)),
    };
    match shown {
        Ok(shown) => Event::default().data(shown),
        Err(failure) => Event::default().event("problem").data(failure.to_json().to_string()),
    }
}

async fn wait_for_sample(
    web: &WebState,
    name: &str,
    query: Option<&str>,
) -> Result<Arc<Sample>, WebFailure> {
    let wait_s = Query::read(query, &["wait"])?.number("wait", WAIT_S, 0.0, MAX_WAIT_S)?;
    let mut looks = web.hub.follow(name)?;
    let first = find_sample(&mut looks);
    match timeout(Duration::from_secs_f64(wait_s), first).await {
        Ok(Some(sample)) => Ok(sample),
        _ => {
            let problem = looks.borrow().problem.clone();
            let problem = if problem.is_empty() { "no value has arrived" } else { &problem };
            Err(missing(name, problem))
        }
    }
}

async fn find_sample(looks: &mut watch::Receiver<ChannelLook>) -> Option<Arc<Sample>> {
    let look = looks.wait_for(|look| look.sample.is_some()).await.ok()?;
    look.sample.clone()
}

fn missing(name: &str, problem: &str) -> WebFailure {
    let remedy = "GET /api/data lists all outputs; ?wait=10 waits longer for a value";
    WebFailure::new(StatusCode::NOT_FOUND, problem, place_of(name), remedy)
}

fn place_of(name: &str) -> String {
    format!("data `{name}`")
}

/// Returns a value with its header as JSON. The value is JSON already, so that one conversion is
/// enough for all clients.
pub(crate) fn describe_sample(name: &str, sample: &Sample) -> Result<String, WebFailure> {
    let value = sample.json().map_err(|error| {
        let remedy = "ask for its image, or use `armor echo`";
        WebFailure::new(StatusCode::UNPROCESSABLE_ENTITY, error, place_of(name), remedy)
    })?;
    let header = describe_header(name, sample);
    Ok(format!("{header},\"value\":{value}}}"))
}

/// Returns the header of a value as the begin of a JSON object.
pub(crate) fn describe_header(name: &str, sample: &Sample) -> String {
    let header = &sample.data.header;
    let mut text = json!({
        "name": name,
        "type": *sample.type_name,
        "sequence": header.sequence,
        "stamp_s": header.stamp_s,
        "lost": sample.lost,
    })
    .to_string();
    text.pop();
    text
}
