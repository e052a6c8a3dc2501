//! The metrics, read by a parser that accepts nothing but the text format of Prometheus.

use std::collections::{BTreeMap, BTreeSet};

use super::*;

/// Metrics by name: type, and the value of each set of labels.
type Families = BTreeMap<String, (String, BTreeMap<String, f64>)>;

#[test]
fn metrics_are_strictly_what_prometheus_reads() {
    let scene = Scene::begin_with_base();
    wait_for("a value", || (scene.get("/api/data/base.count?wait=10").0 == 200).then_some(()));
    let families = wait_for("the component", || {
        let (status, response) = scene.get("/metrics");
        assert_eq!(status, 200);
        assert!(response.contains("content-type: text/plain; version=0.0.4"), "{response}");
        let (_, body) = response.split_once("\r\n\r\n").unwrap();
        let families = parse_metrics(body);
        families["armor_published_total"]
            .1
            .contains_key("data=\"base.count\",type=\"Number\"")
            .then_some(families)
            // A message without a link is not encoded, and its bytes are not counted.
            .filter(|it| bytes_of_count(it) > 0.0)
    });
    assert_eq!(bytes_of_count(&families) % 8.0, 0.0, "a Number has eight bytes");
    assert_eq!(families["armor_up"].1[""], 1.0);
    assert_eq!(families["armor_process_restarts_total"].1["component=\"base\""], 0.0);
    assert!(families["armor_process_memory_bytes"].1["component=\"base\""] > 1e5);
    let states = &families["armor_process_state"].1;
    assert_eq!(states.values().sum::<f64>(), 1.0, "{states:?}");
}

fn bytes_of_count(families: &Families) -> f64 {
    families["armor_published_bytes_total"].1["data=\"base.count\",type=\"Number\""]
}

fn parse_metrics(text: &str) -> Families {
    assert!(text.ends_with('\n'), "the last line must end");
    let (mut families, mut ended) = (Families::new(), BTreeSet::new());
    let (mut current, mut helped) = (String::new(), String::new());
    for line in text.lines() {
        if let Some(help) = line.strip_prefix("# HELP ") {
            helped = help.split_once(' ').expect("a text").0.to_owned();
            continue;
        }
        if let Some(kind) = line.strip_prefix("# TYPE ") {
            let (name, kind) = kind.split_once(' ').expect("a type");
            assert!(["counter", "gauge", "histogram"].contains(&kind), "{line}");
            assert!(name == helped && is_name(name), "{line}");
            assert!(kind != "counter" || name.ends_with("_total"), "{line}");
            assert!(ended.insert(name.to_owned()), "{name} is there twice");
            families.insert(name.into(), (kind.into(), BTreeMap::new()));
            current = name.into();
            continue;
        }
        let (name, labels, value) = parse_sample(line);
        let family = families.get_mut(&current).expect("a type before the first sample");
        let suffix = name.strip_prefix(current.as_str()).expect(line);
        match family.0.as_str() {
            "histogram" => assert!(["_bucket", "_sum", "_count"].contains(&suffix), "{line}"),
            _ => assert_eq!(suffix, "", "{line}"),
        }
        let key = format!("{suffix}{labels}");
        assert!(family.1.insert(key, value).is_none(), "twice: {line}");
    }
    families
}

/// Reads `name{label="value",…} number`.
fn parse_sample(line: &str) -> (&str, &str, f64) {
    let (series, value) = line.rsplit_once(' ').expect(line);
    let value = value.parse().expect(line);
    let Some((name, labels)) = series.split_once('{') else {
        assert!(is_name(series), "{line}");
        return (series, "", value);
    };
    let labels = labels.strip_suffix('}').expect(line);
    let mut rest = labels;
    while !rest.is_empty() {
        let (label, after) = rest.split_once("=\"").expect(line);
        assert!(is_name(label), "{line}");
        let mut characters = after.char_indices();
        let end = loop {
            match characters.next().expect(line) {
                (_, '\\') => {
                    let escaped = characters.next().expect(line).1;
                    assert!(['\\', '"', 'n'].contains(&escaped), "{line}");
                }
                (end, '"') => break end,
                _ => {}
            }
        };
        rest = &after[end + 1..];
        assert!(rest.is_empty() || rest.starts_with(','), "{line}");
        rest = rest.strip_prefix(',').unwrap_or(rest);
    }
    (name, labels, value)
}

fn is_name(name: &str) -> bool {
    let is_part = |c: char| c.is_ascii_alphanumeric() || c == '_';
    name.starts_with(|c: char| c.is_ascii_lowercase()) && name.chars().all(is_part)
}
