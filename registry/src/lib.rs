//! armor-registry.
