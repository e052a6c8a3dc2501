//! armor-sdk.
