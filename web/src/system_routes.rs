//! The system and the names of its data.

use std::collections::HashMap;
use std::sync::Arc;
use std::time::Duration;

use axum::extract::State;
use axum::http::StatusCode;
use axum::response::{IntoResponse, Response};
use serde_json::json;
use tokio::sync::Semaphore;

use crate::failure::{WebFailure, json_response, text_response};
use crate::images::IMAGE_TYPES;
use crate::web_state::WebState;

/// Time within which the registry must answer.
const REGISTRY_WITHIN: Duration = Duration::from_secs(3);

/// `GET /api/system`.
pub(crate) async fn show_system(State(web): State<Arc<WebState>>) -> Response {
    text_response(StatusCode::OK, "application/json", web.system_text().to_string())
}

/// `GET /api/data`.
pub(crate) async fn list_data(State(web): State<Arc<WebState>>) -> Response {
    match run_asking(&web, |web| web.directory.fetch_listing(REGISTRY_WITHIN)).await {
        Ok(Ok(listing)) => {
            let picture = web.watch.picture();
            let mut rates: HashMap<&str, f64> = HashMap::new();
            for link in &picture.links {
                let rate_hz = rates.entry(&link.from).or_default();
                *rate_hz = rate_hz.max(link.rate_hz.unwrap_or_default());
            }
            let has_image = |name: &str| IMAGE_TYPES.split([',', ' ']).any(|it| it == name);
            let shown = listing.data.iter().map(|entry| {
                json!({
                    "data": entry.data,
                    "type": entry.type_name,
                    "latched": entry.latched,
                    "schema": entry.schema,
                    "image": has_image(&entry.type_name),
                    "rate_hz": rates.get(entry.data.as_str()),
                })
            });
            json_response(StatusCode::OK, &json!({"data": shown.collect::<Vec<_>>()}))
        }
        Ok(Err(error)) => no_registry(error.to_string()).into_response(),
        Err(failure) => failure.into_response(),
    }
}

fn no_registry(error: String) -> WebFailure {
    let remedy = "start the system with `armor run FILE`, or wait until its registry is back";
    WebFailure::new(StatusCode::BAD_GATEWAY, error, "the registry", remedy)
}

/// Runs work that waits for a process of the system, on a thread for it. Only a few run at the same
/// time: a process that hangs must not take all threads.
pub(crate) async fn run_asking<R: Send + 'static>(
    web: &Arc<WebState>,
    work: impl FnOnce(&WebState) -> R + Send + 'static,
) -> Result<R, WebFailure> {
    run_waiting(&web.asking, web, work).await
}

/// Runs work that waits, on a thread for it, once one of these places is free. The place is taken until
/// the work has ended, also if the client has left.
pub(crate) async fn run_waiting<R: Send + 'static>(
    places: &Arc<Semaphore>,
    web: &Arc<WebState>,
    work: impl FnOnce(&WebState) -> R + Send + 'static,
) -> Result<R, WebFailure> {
    let fail = |what: &str| {
        let status = StatusCode::SERVICE_UNAVAILABLE;
        WebFailure::new(status, what, "this server", "try again in a few seconds")
    };
    let place = Arc::clone(places).acquire_owned().await.map_err(|_| fail("the server ends"))?;
    let web = Arc::clone(web);
    let running = tokio::task::spawn_blocking(move || {
        let done = work(&web);
        drop(place);
        done
    });
    running.await.map_err(|_| fail("the request was not carried out: its thread has panicked"))
}
