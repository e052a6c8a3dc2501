//! armor-bench.
