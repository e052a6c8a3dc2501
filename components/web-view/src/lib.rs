//! The operator's page as a component: it serves the page, and publishes what the operator orders.
//! The server is in `armor-web`; `ports` alone handles messages.

mod ports;

pub use ports::WebView;
