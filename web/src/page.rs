//! The page for operators: files that are part of the program, so that it needs no network.

use std::sync::Arc;

use axum::Router;
use axum::http::StatusCode;
use axum::routing::get;

use crate::failure::text_response;
use crate::web_state::WebState;

/// The files of the page: path, type and content.
pub(crate) const FILES: &[(&str, &str, &[u8])] = &[
    ("/", "text/html; charset=utf-8", include_bytes!("page/index.html")),
    ("/stop.html", "text/html; charset=utf-8", include_bytes!("page/stop.html")),
    ("/style.css", "text/css; charset=utf-8", include_bytes!("page/style.css")),
    ("/app.js", "text/javascript; charset=utf-8", include_bytes!("page/app.js")),
    ("/map.js", "text/javascript; charset=utf-8", include_bytes!("page/map.js")),
    ("/stop.js", "text/javascript; charset=utf-8", include_bytes!("page/stop.js")),
    ("/drive.js", "text/javascript; charset=utf-8", include_bytes!("page/drive.js")),
    ("/session.js", "text/javascript; charset=utf-8", include_bytes!("page/session.js")),
    ("/sw.js", "text/javascript; charset=utf-8", include_bytes!("page/sw.js")),
    (
        "/manifest.webmanifest",
        "application/manifest+json",
        include_bytes!("page/manifest.webmanifest"),
    ),
    ("/icon.svg", "image/svg+xml", include_bytes!("page/icon.svg")),
];

/// Adds the routes of the page.
pub(crate) fn add_pages(router: Router<Arc<WebState>>) -> Router<Arc<WebState>> {
    FILES.iter().fold(router, |router, (path, content_type, bytes)| {
        router.route(path, get(|| async { text_response(StatusCode::OK, content_type, *bytes) }))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_page_loads_nothing_from_elsewhere_and_its_worker_keeps_every_file() {
        let text = |path: &str| {
            let file = FILES.iter().find(|(other, ..)| *other == path).expect(path);
            String::from_utf8(file.2.to_vec()).expect("text")
        };
        let worker = text("/sw.js");
        for (path, ..) in FILES {
            // The namespace of an image is no address, and STOP is loaded from this host.
            let shown = text(path).replace("http://www.w3.org/", "").replace("http://${other}", "");
            assert!(
                !shown.contains("http://") && !shown.replace("https://…", "").contains("https://"),
                "{path}"
            );
            let is_kept = *path == "/sw.js" || worker.contains(&format!("'{path}'"));
            assert!(is_kept, "{path} is missing in sw.js");
        }
    }
}
