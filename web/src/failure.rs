//! An error as a client gets it: JSON that names what was wrong, where, and what to do.

use axum::body::Body;
use axum::http::{HeaderValue, StatusCode, header};
use axum::response::{IntoResponse, Response};
use serde_json::{Value, json};

/// Why a request was not carried out.
#[derive(Debug)]
pub(crate) struct WebFailure {
    status: StatusCode,
    what: String,
    place: String,
    remedy: String,
}

impl WebFailure {
    /// A failure: what was wrong, where, and what to do.
    pub(crate) fn new(
        status: StatusCode,
        what: impl Into<String>,
        place: impl Into<String>,
        remedy: impl Into<String>,
    ) -> Self {
        Self { status, what: what.into(), place: place.into(), remedy: remedy.into() }
    }

    /// A request that is not understood.
    pub(crate) fn bad(
        what: impl Into<String>,
        place: impl Into<String>,
        remedy: impl Into<String>,
    ) -> Self {
        Self::new(StatusCode::BAD_REQUEST, what, place, remedy)
    }

    /// Returns what was wrong.
    pub(crate) fn what(&self) -> &str {
        &self.what
    }

    /// Returns the failure as JSON.
    pub(crate) fn to_json(&self) -> Value {
        let Self { status, what, place, remedy } = self;
        let status = status.as_u16();
        json!({"error": {"status": status, "what": what, "where": place, "remedy": remedy}})
    }
}

impl IntoResponse for WebFailure {
    fn into_response(self) -> Response {
        json_response(self.status, &self.to_json())
    }
}

/// Returns a response with a JSON body.
pub(crate) fn json_response(status: StatusCode, value: &Value) -> Response {
    text_response(status, "application/json", value.to_string())
}

/// Returns a response with a body of this type.
pub(crate) fn text_response(
    status: StatusCode,
    content_type: &'static str,
    body: impl Into<Body>,
) -> Response {
    let mut response = Response::new(body.into());
    *response.status_mut() = status;
    let content_type = HeaderValue::from_static(content_type);
    response.headers_mut().insert(header::CONTENT_TYPE, content_type);
    response
}
