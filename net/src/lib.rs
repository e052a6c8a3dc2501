//! armor-net.
