//! Names of components, ports, parameters, places: `[A-Za-z][A-Za-z0-9_-]*`, at most 64 bytes.

/// Longest name in bytes.
pub const MAX_NAME_LEN: usize = 64;

/// Whether `name` is a well-formed name.
pub fn is_name(name: &str) -> bool {
    name.len() <= MAX_NAME_LEN
        && name.starts_with(|c: char| c.is_ascii_alphabetic())
        && name.bytes().all(|b| b.is_ascii_alphanumeric() || matches!(b, b'_' | b'-'))
}

/// Splits `component.port` into its two names, if both are well-formed.
pub fn split_data(data: &str) -> Option<(&str, &str)> {
    data.split_once('.').filter(|(component, port)| is_name(component) && is_name(port))
}
