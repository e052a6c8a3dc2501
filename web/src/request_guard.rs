//! What every request passes: no other web page may use this server, and none takes for ever.
//!
//! On loopback the kernel has already checked that the client belongs to the user of the system
//! (`server.rs`); beyond, the cookie of a session names a person, whose role each route checks. But
//! the same browser also runs pages of strangers. A page of another host that has given
//! its name the address 127.0.0.1 (DNS rebinding) is recognised by `Host`; one that sends requests
//! across origins by `Origin` and `Sec-Fetch-Site`, which no page can change.

use std::sync::Arc;
use std::time::{Duration, Instant};

use armor_socket::is_loopback_name;
use axum::extract::{Request, State};
use axum::http::{HeaderMap, HeaderValue, Method, StatusCode, header};
use axum::middleware::Next;
use axum::response::{IntoResponse, Response};

use crate::failure::WebFailure;
use crate::remote::RemoteAccess;
use crate::remote::caller::Caller;
use crate::remote::connection::RemoteConnection;
use crate::remote::login_routes::identify;
use crate::web_state::WebState;

/// Longest time until a response begins: longer than every wait of a handler.
const RESPONSE_WITHIN: Duration = Duration::from_secs(15);
/// What the page may load: only what this server serves, under either name of this host.
const PAGE_POLICY: &str = "default-src 'self'; img-src 'self' blob: data:; \
                           frame-src http://localhost:* http://127.0.0.1:*; \
                           frame-ancestors 'none'; base-uri 'none'; form-action 'none'";
/// The page with nothing but STOP, which the page of the other name shows in a frame.
const STOP_PAGE: &str = "/stop.html";
/// What the page may load over HTTPS: the session belongs to one host name, so nothing is framed. A
/// browser may take `'self'` for HTTPS only, so the WebSockets are named.
const REMOTE_POLICY: &str = "default-src 'self'; img-src 'self' blob: data:; frame-ancestors 'none'; \
                             base-uri 'none'; form-action 'none'; connect-src 'self' wss://";
const STOP_POLICY: &str = "default-src 'self'; frame-ancestors http://localhost:* \
                           http://127.0.0.1:*; base-uri 'none'; form-action 'none'";

/// Checks a request, carries it out, and completes the response.
pub(crate) async fn guard_request(
    State(web): State<Arc<WebState>>,
    mut request: Request,
    next: Next,
) -> Response {
    let begin = Instant::now();
    let path = request.uri().path().to_owned();
    let server = web.remote.as_deref().map_or(Server::Local, Server::Remote);
    let checked = check_origin(&server, request.method(), &path, request.headers());
    let host = checked.as_ref().ok().cloned();
    let mut response = match checked.and_then(|_| name_caller(&web, &mut request)) {
        Err(failure) => failure.into_response(),
        Ok(()) => match tokio::time::timeout(RESPONSE_WITHIN, next.run(request)).await {
            Ok(response) => response,
            Err(_) => WebFailure::new(
                StatusCode::GATEWAY_TIMEOUT,
                format!("there was no response within {} s", RESPONSE_WITHIN.as_secs()),
                path.as_str(),
                "try again; `armor ps` shows which process does not answer",
            )
            .into_response(),
        },
    };
    if response.status().is_client_error() || response.status().is_server_error() {
        response = describe_failure(response, &path);
    }
    let remote_host = host.filter(|_| web.remote.is_some());
    set_headers(response.headers_mut(), &path, remote_host.as_deref());
    web.counters.count_response(response.status(), begin.elapsed());
    response
}

/// By which names a server knows itself.
enum Server<'a> {
    Local,
    Remote(&'a RemoteAccess),
}

/// Notes in the request who sends it.
fn name_caller(web: &WebState, request: &mut Request) -> Result<(), WebFailure> {
    let caller = match &web.remote {
        None => Caller::Local,
        Some(remote) => {
            let Some(connection) = request.extensions().get::<Arc<RemoteConnection>>().cloned()
            else {
                let what = "this connection is not encrypted";
                let remedy = "open the page with https://";
                return Err(WebFailure::new(StatusCode::FORBIDDEN, what, "the connection", remedy));
            };
            let (caller, session) = identify(remote, request.headers());
            if let Some(session) = session {
                connection.bind(session, remote);
            }
            caller
        }
    };
    request.extensions_mut().insert(caller);
    Ok(())
}

/// Refuses what a page of another origin has sent; returns the host that the request names.
fn check_origin(
    server: &Server<'_>,
    method: &Method,
    path: &str,
    headers: &HeaderMap,
) -> Result<String, WebFailure> {
    let text = |name: header::HeaderName| {
        let mut values = headers.get_all(name).iter();
        let first = values.next().map(|value| value.to_str().unwrap_or("\u{fffd}"));
        // A second one is refused as one that cannot be read.
        if values.next().is_some() { Some("\u{fffd}") } else { first }
    };
    let host = text(header::HOST).unwrap_or_default();
    let (is_own, scheme, remedy) = match server {
        Server::Local => (
            is_loopback_name(host),
            "http://",
            "open it as http://127.0.0.1:PORT or http://localhost:PORT; from another host through \
             a tunnel (docs/web.md)",
        ),
        Server::Remote(remote) => (
            remote.is_own_host(host),
            "https://",
            "open it under a name or address in its certificate; `armor keys renew NAME --at \
             ADDRESS` makes one with others",
        ),
    };
    if !is_own {
        let what = format!("this server is not `{}`", host.escape_default());
        let status = StatusCode::MISDIRECTED_REQUEST;
        return Err(WebFailure::new(status, what, "the header Host", remedy));
    }
    let refuse = |name: &str, value: &str| {
        Err(WebFailure::new(
            StatusCode::FORBIDDEN,
            format!("another web page has sent this (`{}`)", value.escape_default()),
            format!("the header {name}"),
            "only the page of this server may use it; programs leave this header out",
        ))
    };
    if let Some(origin) = text(header::ORIGIN)
        && origin.strip_prefix(scheme) != Some(host)
    {
        return refuse("Origin", origin);
    }
    let is_page = method == Method::GET && !path.starts_with("/api/") && path != "/metrics";
    let site = text(header::HeaderName::from_static("sec-fetch-site"));
    match site {
        // A link on another page may lead to the page here.
        None | Some("same-origin" | "none") => Ok(host.to_owned()),
        Some(_) if is_page => Ok(host.to_owned()),
        Some(site) => refuse("Sec-Fetch-Site", site),
    }
}

/// Gives a failure of the framework, such as an unknown route, the form of all failures.
fn describe_failure(response: Response, path: &str) -> Response {
    let is_json = |value: &HeaderValue| value == "application/json";
    if response.headers().get(header::CONTENT_TYPE).is_some_and(is_json) {
        return response;
    }
    let status = response.status();
    let (what, remedy) = match status {
        StatusCode::NOT_FOUND => ("there is no such route", "GET /api/openapi.json lists all"),
        StatusCode::METHOD_NOT_ALLOWED => {
            ("this route has no such method", "GET /api/openapi.json lists the methods of each")
        }
        StatusCode::PAYLOAD_TOO_LARGE => ("the body is too long", "send at most 64 KiB"),
        _ => ("the request is not understood", "GET /api/openapi.json describes each route"),
    };
    let mut described = WebFailure::new(status, what, path, remedy).into_response();
    if let Some(allowed) = response.headers().get(header::ALLOW) {
        described.headers_mut().insert(header::ALLOW, allowed.clone());
    }
    described
}

fn set_headers(headers: &mut HeaderMap, path: &str, remote_host: Option<&str>) {
    let is_data = path.starts_with("/api/") || path == "/metrics";
    let mut set = |name: &'static str, value: &'static str| {
        headers.insert(header::HeaderName::from_static(name), HeaderValue::from_static(value));
    };
    if path == STOP_PAGE && remote_host.is_none() {
        set("content-security-policy", STOP_POLICY);
    } else {
        set("content-security-policy", PAGE_POLICY);
        set("x-frame-options", "DENY");
    }
    set("x-content-type-options", "nosniff");
    set("referrer-policy", "no-referrer");
    set("cross-origin-resource-policy", "same-origin");
    set("cross-origin-opener-policy", "same-origin");
    set("cache-control", if is_data { "no-store" } else { "no-cache" });
    // The host was found to be one of this server's, so it is a name and a port.
    let policy =
        remote_host.and_then(|host| HeaderValue::from_str(&format!("{REMOTE_POLICY}{host}")).ok());
    if let Some(policy) = policy {
        headers.insert(header::CONTENT_SECURITY_POLICY, policy);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn check(method: &Method, path: &str, headers: &[(&'static str, &str)]) -> u16 {
        let mut map = HeaderMap::new();
        for (name, value) in headers {
            let name = header::HeaderName::from_static(name);
            map.append(name, HeaderValue::from_str(value).unwrap());
        }
        let failure = check_origin(&Server::Local, method, path, &map).err();
        failure.map_or(200, |failure| failure.into_response().status().as_u16())
    }

    #[test]
    fn only_names_of_loopback_are_this_server() {
        for host in ["127.0.0.1", "127.0.0.1:8080", "localhost:1", "[::1]:8080", "localhost"] {
            assert_eq!(check(&Method::GET, "/api/system", &[("host", host)]), 200, "{host}");
        }
        for host in [
            "evil.example",
            "127.0.0.1.evil.example",
            "localhost.evil.example:80",
            "127.0.0.1:8080@evil.example",
            "127.0.0.1:",
            "127.0.0.1:99999",
            "",
        ] {
            assert_eq!(check(&Method::GET, "/api/system", &[("host", host)]), 421, "{host}");
        }
        assert_eq!(check(&Method::GET, "/", &[]), 421);
        let twice = [("host", "localhost"), ("host", "localhost")];
        assert_eq!(check(&Method::GET, "/", &twice), 421);
    }

    #[test]
    fn a_page_of_another_origin_can_do_nothing() {
        let host = ("host", "127.0.0.1:8080");
        for origin in [
            "http://evil.example",
            "null",
            "http://127.0.0.1:3000",
            "https://127.0.0.1:8080",
            "http://127.0.0.1:8080.evil.example",
        ] {
            for method in [Method::GET, Method::POST, Method::PUT] {
                let headers = [host, ("origin", origin)];
                assert_eq!(check(&method, "/api/stop", &headers), 403, "{origin}");
            }
        }
        for site in ["cross-site", "same-site", "x"] {
            let headers = [host, ("sec-fetch-site", site)];
            assert_eq!(check(&Method::GET, "/api/data/camera.image/image", &headers), 403);
            assert_eq!(check(&Method::GET, "/", &headers), 200, "a link to the page");
        }
        let own = [host, ("origin", "http://127.0.0.1:8080"), ("sec-fetch-site", "same-origin")];
        assert_eq!(check(&Method::POST, "/api/stop", &own), 200);
        assert_eq!(check(&Method::POST, "/api/stop", &[host]), 200, "a program");
    }
}
