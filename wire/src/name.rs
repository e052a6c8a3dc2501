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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_words_of_ascii_that_begin_with_a_letter() {
        let long = "x".repeat(MAX_NAME_LEN);
        for name in ["a", "laser-2", "Front_left", long.as_str()] {
            assert!(is_name(name), "{name}");
        }
        let too_long = "x".repeat(MAX_NAME_LEN + 1);
        for name in ["", "2laser", "-a", "_a", "a b", "a.b", "é", "a\n", too_long.as_str()] {
            assert!(!is_name(name), "{name}");
        }
    }

    #[test]
    fn data_is_component_dot_port() {
        assert_eq!(split_data("laser.scan"), Some(("laser", "scan")));
        for data in ["laser", "laser.", ".scan", "a.b.c", "a..b", ""] {
            assert_eq!(split_data(data), None, "{data}");
        }
    }
}
