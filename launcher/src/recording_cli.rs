//! Recording a running system, and working with recordings.

pub mod bag;
mod carmen_writer;
mod convert;
mod csv_reader;
pub mod known_types;
pub mod record;

/// Returns a length in bytes as people read it.
fn format_len(bytes: u64) -> String {
    let units = [("GB", 1e9), ("MB", 1e6), ("kB", 1e3)];
    let unit = units.iter().find(|(_, size)| bytes as f64 >= *size);
    unit.map_or_else(
        || format!("{bytes} B"),
        |(unit, size)| format!("{:.1} {unit}", bytes as f64 / size),
    )
}

#[cfg(test)]
mod tests {
    use super::format_len;

    #[test]
    fn a_length_has_one_decimal() {
        let texts = [0, 999, 1500, 2_340_000, 1_000_000_000].map(format_len);
        assert_eq!(texts, ["0 B", "999 B", "1.5 kB", "2.3 MB", "1.0 GB"]);
    }
}
