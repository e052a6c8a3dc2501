//! All findings of a file together: their order, their form as JSON, and what is left out.

use armor_robotfile::{Colours, MAX_FINDINGS};

use super::{all_of, reading, system};

#[test]
fn all_findings_come_at_once_sorted_and_as_json() {
    let file = system(
        "\n<component name=\"a\" kind=\"k\" rate=\"x\"/>\n<component name=\"a\" kind=\"k\"/>\n<link from=\"b.x\" to=\"c.y\"/>",
    );
    let (reading, _) = reading(&file, None);
    let json: Vec<serde_json::Value> =
        reading.findings.iter().map(|finding| serde_json::to_value(finding).unwrap()).collect();
    let codes: Vec<_> = json.iter().map(|finding| finding["code"].as_str().unwrap()).collect();
    assert_eq!(codes, ["E0019", "E0101", "E0103", "E0103"]);
    assert_eq!(json[0]["line"], 2);
    assert_eq!(json[0]["column"], 36);
    assert_eq!(json[0]["end_column"], 37);
    assert_eq!(json[0]["text"], "x");
    assert_eq!(json[0]["file"], "a.xml");
    assert_eq!(json[0]["severity"], "error");
    assert_eq!(json[1]["related"][0]["line"], 2);
    assert_eq!(json[3]["text"], "c");
}

#[test]
fn left_out_findings_are_counted() {
    let links = r#"<link from="a.x" to="b.y"/>"#.repeat(MAX_FINDINGS);
    let codes = all_of(&system(&links));
    assert_eq!(codes.len(), MAX_FINDINGS + 1);
    assert_eq!(codes.last(), Some(&"N0999"));
}

#[test]
fn how_many_findings_were_left_out_is_right_also_after_the_check() {
    let parts: String =
        (0..4000).map(|n| format!("<component name=\"c{n}\" kind=\"k\" rate=\"x\"/>")).collect();
    let (mut reading, _) = reading(&system(&parts), None);
    reading.findings.sort();
    for findings in [reading.findings.without_notes(), reading.findings] {
        let shown = findings.render(Colours::No);
        assert_eq!(shown.matches("3500 more findings were left out").count(), 1, "{shown}");
        assert_eq!(findings.iter().len(), 501);
    }
}
