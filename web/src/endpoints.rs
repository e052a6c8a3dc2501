//! The table of all routes. The router and the OpenAPI description are both made from it.

use std::sync::Arc;

use armor_wire::acting::KeyRole;
use axum::Router;
use axum::extract::DefaultBodyLimit;
use axum::http::{StatusCode, Uri};
use axum::middleware::{from_fn, from_fn_with_state};
use axum::response::IntoResponse;
use axum::routing::{MethodRouter, get, post, put};

use crate::failure::WebFailure;
use crate::remote::caller::check_role;
use crate::remote::login_routes;
use crate::request_guard::guard_request;
use crate::web_state::WebState;
use crate::{
    control_routes, data_routes, live, metrics, mission_routes, openapi, page, parameter_routes,
    stop_routes, system_routes,
};

/// Longest body of a request, in bytes: an order that moves many tokens has a tenth of it.
const MAX_BODY_LEN: usize = 64 << 10;

type Handler = fn() -> MethodRouter<Arc<WebState>>;

/// A route and what is known about it.
pub(crate) struct Endpoint {
    pub(crate) method: &'static str,
    pub(crate) path: &'static str,
    /// Name of the operation, for generated clients.
    pub(crate) id: &'static str,
    pub(crate) summary: &'static str,
    /// Parameters after `?`: name, JSON type and what it is.
    pub(crate) query: &'static [(&'static str, &'static str, &'static str)],
    /// JSON schema of the body; empty without one.
    pub(crate) body: &'static str,
    /// Type of the response; empty for a WebSocket.
    pub(crate) content_type: &'static str,
    /// The least role of a person on another host who may send it; `None`: a stranger may.
    pub(crate) needs: Option<KeyRole>,
    /// Whether the thread for STOP serves it.
    is_stop: bool,
    handler: Handler,
}

const JSON: &str = "application/json";
const SWITCH: &str = "boolean";
const NUMBER: &str = "number";

macro_rules! endpoint {
    ($method:literal $path:literal, $id:literal, $summary:literal, $content_type:expr,
     $handler:expr $(, query: $query:expr)? $(, body: $body:literal)? $(, needs: $needs:expr)?
     $(, stop: $stop:literal)?) => {
        Endpoint {
            method: $method,
            path: $path,
            id: $id,
            summary: $summary,
            query: endpoint!(@or &[] $(, $query)?),
            body: endpoint!(@or "" $(, $body)?),
            content_type: $content_type,
            needs: endpoint!(@or Some(KeyRole::Observer) $(, $needs)?),
            is_stop: endpoint!(@or false $(, $stop)?),
            handler: || $handler,
        }
    };
    (@or $default:expr) => { $default };
    (@or $default:expr, $given:expr) => { $given };
}

/// All routes but those of the page.
pub(crate) const ENDPOINTS: &[Endpoint] = &[
    endpoint!("GET" "/api/system", "showSystem",
        "The processes, links and hosts of the system, and whether STOP is in force.",
        JSON, get(system_routes::show_system)),
    endpoint!("GET" "/api/data", "listData",
        "All outputs with their types.",
        JSON, get(system_routes::list_data)),
    endpoint!("GET" "/api/data/{name}", "showValue",
        "The newest value of an output.",
        JSON, get(data_routes::show_value),
        query: &[("wait", NUMBER, "seconds to wait for a value, at most 10")]),
    endpoint!("GET" "/api/data/{name}/stream", "streamValues",
        "The values of an output as server-sent events. A slow client gets the newest.",
        "text/event-stream", get(data_routes::stream_values),
        query: &[("max_hz", NUMBER, "most values per second, 0.01 to 100")]),
    endpoint!("GET" "/api/data/{name}/image", "showImage",
        "The newest value as an image. The header `armor-place` has the place of a map as JSON.",
        "image/*", get(data_routes::show_image),
        query: &[("wait", NUMBER, "seconds to wait for a value, at most 10")]),
    endpoint!("GET" "/api/live", "live",
        "WebSocket: several data at chosen rates, `system` and `mission` too.",
        "", get(live::hold_live)),
    endpoint!("GET" "/api/parameters", "listParameters",
        "All parameters with their values and ranges.",
        JSON, get(parameter_routes::list_parameters)),
    endpoint!("GET" "/api/parameters/{component}/{name}", "showParameter",
        "One parameter.",
        JSON, get(parameter_routes::show_parameter)),
    endpoint!("PUT" "/api/parameters/{component}/{name}", "setParameter",
        "Writes a value into the file, if the file is valid with it.",
        JSON, put(parameter_routes::set_parameter),
        body: r#"{"type":"object","required":["value"],"additionalProperties":false,
            "properties":{"value":{"type":["string","null"]}}}"#,
        needs: Some(KeyRole::Engineer)),
    endpoint!("GET" "/api/mission", "showMission",
        "The marking of the mission: places, transitions, questions, orders.",
        JSON, get(mission_routes::show_mission)),
    endpoint!("POST" "/api/mission/orders", "giveOrder",
        "An order to the mission. 409 if it is refused, with the reason. Beyond loopback an observer \
         may order `pause` and `safe`, and the author is the person who is logged in.",
        JSON, post(mission_routes::give_order),
        body: r#"{"type":"object","required":["order"],"additionalProperties":false,
            "properties":{
                "order":{"enum":["fire","confirm","decline","pause","resume","safe","move"]},
                "transition":{"type":"string"},
                "moves":{"type":"array","items":{"type":"object","required":["from","to"],
                    "additionalProperties":false,"properties":{"from":{"type":"string"},
                    "to":{"type":"string"},"tokens":{"type":"integer","minimum":1}}}},
                "take":{"type":"boolean"},"author":{"type":"string"}}}"#),
    endpoint!("GET" "/api/control", "control",
        "WebSocket of the client in control: drives the robot and releases STOP.",
        "", get(control_routes::hold_control),
        query: &[("take", SWITCH, "take control from another client")],
        needs: Some(KeyRole::Operator)),
    endpoint!("GET" "/api/stop", "showStop",
        "Whether STOP is in force.",
        JSON, get(stop_routes::show_stop), stop: true),
    endpoint!("POST" "/api/stop", "stop",
        "STOP. Any client may order it; 502 if it was refused, 504 if its delivery is not known.",
        JSON, post(stop_routes::stop), stop: true),
    endpoint!("POST" "/api/stop/release", "release",
        "Releases STOP. Only the client in control may, with the token of its WebSocket. 409 if it is \
         refused or STOP was ordered after it, 504 if it has waited too long: then it was not sent.",
        JSON, post(stop_routes::release),
        body: r#"{"type":"object","required":["control"],"additionalProperties":false,
            "properties":{"control":{"type":"string"}}}"#,
        needs: Some(KeyRole::Operator), stop: true),
    endpoint!("GET" "/api/stop/live", "stopLive",
        "WebSocket that is ready before STOP is needed.",
        "", get(stop_routes::hold_stop), stop: true),
    endpoint!("GET" "/api/session", "showSession",
        "Who is logged in, and the fingerprints of the certificates.",
        JSON, get(login_routes::show_session), needs: None),
    endpoint!("POST" "/api/login", "logIn",
        "Exchanges the secret of an invitation for the cookie of a session. 403 if it is not \
         accepted, 409 if another person is logged in, 429 after several wrong ones. With the same \
         `attempt` it is repeated within 10 min without using another place.",
        JSON, post(login_routes::log_in),
        body: r#"{"type":"object","required":["invite"],"additionalProperties":false,
            "properties":{"invite":{"type":"string"},"attempt":{"type":"string",
            "pattern":"^[0-9a-fA-F]{40}$"},"replace":{"type":"boolean"}}}"#,
        needs: None),
    endpoint!("POST" "/api/logout", "logOut",
        "Ends the session of the cookie.",
        JSON, post(login_routes::log_out), needs: None),
    endpoint!("GET" "/authority.crt", "showAuthority",
        "The certificate of the authority that has certified this robot, in DER.",
        "application/x-x509-ca-cert", get(login_routes::show_authority), needs: None),
    endpoint!("GET" "/api/openapi.json", "describe",
        "This description.",
        JSON, get(openapi::show_description)),
    endpoint!("GET" "/metrics", "metrics",
        "Rates, losses, latencies, restarts, marking, processor and memory, for Prometheus.",
        "text/plain", get(metrics::show_metrics)),
];

/// Returns the router of all threads but that of STOP.
pub(crate) fn make_router(web: Arc<WebState>) -> Router {
    finish(page::add_pages(add_endpoints(|_| true)), web)
}

/// Returns the router of the thread for STOP.
pub(crate) fn make_stop_router(web: Arc<WebState>) -> Router {
    let router = add_endpoints(|endpoint| endpoint.is_stop);
    finish(router, web).layer(from_fn(stop_routes::end_connection))
}

fn add_endpoints(is_served: impl Fn(&Endpoint) -> bool) -> Router<Arc<WebState>> {
    let served = ENDPOINTS.iter().filter(|endpoint| is_served(endpoint));
    served.fold(Router::new(), |router, it| {
        let handler = (it.handler)();
        router.route(
            it.path,
            match it.needs {
                Some(needed) => {
                    let checked = (needed, it.subject());
                    handler.route_layer(from_fn_with_state(checked, check_role))
                }
                None => handler,
            },
        )
    })
}

impl Endpoint {
    /// What a request is, as the subject of a sentence.
    fn subject(&self) -> &'static str {
        match (self.method, self.path) {
            (_, "/api/control") => "taking control",
            (_, "/api/stop/release") => "releasing STOP",
            ("PUT", _) => "setting a parameter",
            _ => "this",
        }
    }
}

fn finish(router: Router<Arc<WebState>>, web: Arc<WebState>) -> Router {
    router
        .fallback(|uri: Uri| async move {
            let remedy = "GET /api/openapi.json lists all routes";
            let status = StatusCode::NOT_FOUND;
            WebFailure::new(status, "there is no such route", uri.path(), remedy).into_response()
        })
        .layer(DefaultBodyLimit::max(MAX_BODY_LEN))
        .layer(from_fn_with_state(Arc::clone(&web), guard_request))
        .with_state(web)
}
