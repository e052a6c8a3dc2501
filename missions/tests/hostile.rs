//! Whatever the bytes: an answer, soon, in bounded memory, with spans inside the file.
// A test may panic where a program may not.
#![allow(clippy::unwrap_used)]

use std::path::Path;
use std::time::{Duration, Instant};

use armor_missions::{Colours, MAX_FINDINGS, Reading, check, read};
use proptest::prelude::*;

/// Far beyond what any of these takes (milliseconds); a hang or a quadratic walk does not pass it.
const DEADLINE: Duration = Duration::from_secs(20);

fn read_all(bytes: &[u8]) -> Reading {
    let started = Instant::now();
    let reading = read(Path::new("a.xml"), &mut |path| {
        // An include finds the same bytes: the worst that it could find.
        if path.ends_with("gone") {
            Err(std::io::ErrorKind::NotFound.into())
        } else {
            Ok(bytes.to_vec())
        }
    });
    let reading = check(reading, &[], Some(&Default::default()));
    assert!(started.elapsed() < DEADLINE, "{:?}", started.elapsed());
    assert!(reading.findings.iter().count() <= MAX_FINDINGS + 1);
    reading
}

/// Every location lies in its file and can be shown.
fn spans_hold(reading: &Reading) {
    for finding in &reading.findings {
        let related = finding.related.iter().map(|(at, _)| at);
        for at in finding.at.iter().chain(related) {
            let text = at.source.text();
            assert!(text.get(at.span.start()..at.span.end()).is_some(), "{at} of {finding}");
            let (line, column) = at.line_column();
            assert!(line >= 1 && column >= 1 && line <= text.split('\n').count());
        }
        assert!(finding.render(Colours::Yes).contains(finding.code.as_str()));
        serde_json::to_string(finding).unwrap();
    }
}

fn refused(code: &str, bytes: &[u8]) {
    let reading = read_all(bytes);
    spans_hold(&reading);
    let codes: Vec<_> = reading.findings.iter().map(|finding| finding.code.as_str()).collect();
    assert!(codes.contains(&code), "{codes:?}");
    assert!(!reading.is_valid());
}

#[test]
fn eighty_thousand_attributes() {
    let attributes: String = (0..80_000).map(|n| format!(" a{n}=''")).collect();
    refused("E0007", format!("<armor version='1'{attributes}/>").as_bytes());
}

#[test]
fn two_million_nested_tags() {
    refused("E0001", "<a>".repeat(2_000_000).as_bytes());
    // As many as the limit of the length lets through.
    refused("E0006", "<a>".repeat((1 << 20) / 3).as_bytes());
}

#[test]
fn a_billion_laughs() {
    let mut bomb = String::from("<!DOCTYPE lolz [<!ENTITY lol0 \"lol\">");
    for n in 1..10 {
        let ten = format!("&lol{};", n - 1).repeat(10);
        bomb += &format!("<!ENTITY lol{n} \"{ten}\">");
    }
    bomb += "]><armor version=\"1\">&lol9;</armor>";
    refused("E0005", bomb.as_bytes());
}

#[test]
fn more_faults_than_anyone_reads() {
    let reading = read_all(
        format!("<armor version='1'><system>{}</system></armor>", "<x/>".repeat(20_000)).as_bytes(),
    );
    assert_eq!(reading.findings.iter().count(), MAX_FINDINGS + 1);
    assert_eq!(reading.findings.iter().filter(|f| f.code.as_str() == "N0999").count(), 1);
    refused("E0008", format!("<a>{}</a>", "<b/>".repeat(200_000)).as_bytes());
    refused("E0010", &[7; 1 << 20]);
    refused("E0009", format!("<a>{}</a>", "&".repeat((1 << 20) - 7)).as_bytes());
    refused("E0012", format!("<a>{}", "</b>".repeat((1 << 18) - 1)).as_bytes());
}

#[test]
fn as_many_of_each_as_fit() {
    let place = |n: usize| format!("<place name='p{n}' components='c0 c1 c2'/>");
    let places: String = (0..5000).map(place).collect();
    refused(
        "E0008",
        format!("<armor version='1'><system/><mission>{places}</mission></armor>").as_bytes(),
    );
    let sets = "<exclusive components='a b'/>".repeat(4000);
    let places: String =
        (0..4000).map(|n| format!("<place name='p{n}' components='a b'/>")).collect();
    let file = format!(
        "<armor version='1'><system><component name='a' kind='k'/><component name='b' kind='k'/></system><mission safe='p0'>{sets}{places}</mission></armor>"
    );
    refused("E0207", file.as_bytes());
    let places: String =
        (0..2000).map(|n| format!("<place name='p{n}' components='a b'/>")).collect();
    let waiting: String =
        (0..4000).map(|n| format!("<transition name='t{n}' from='x{n}' on='b.done'/>")).collect();
    let file = format!(
        "<armor version='1'><system><component name='a' kind='k'/><component name='b' kind='k'/></system><mission safe='p0'>{places}{waiting}</mission></armor>"
    );
    refused("E0203", file.as_bytes());
    let long = "x".repeat(500_000);
    refused("E0103", format!("<armor version='1'><system><component name='{long}' kind='k'/><link from='a.b' to='c.d'/></system></armor>").as_bytes());
}

#[test]
fn not_text() {
    refused("E0002", b"<armor version='1'>\xff</armor>");
    refused("E0002", b"\xff\xfe<\0a\0/\0>\0");
    refused(
        "E0002",
        "<?xml version='1.0' encoding='latin1'?><armor version='1'><system/></armor>".as_bytes(),
    );
}

#[test]
fn one_byte_order_mark_and_no_more() {
    let file = "\u{feff}<armor version='1'><system/></armor>";
    assert!(read_all(file.as_bytes()).is_valid());
    refused("E0004", format!("\u{feff}{file}").as_bytes());
}

#[test]
fn a_thousand_components_and_three_thousand_links() {
    let components: String =
        (0..1000).map(|n| format!("<component name='c{n}' kind='k'/>\n")).collect();
    let links: String = (0..3000)
        .map(|n| {
            format!("<link from='c{}.out' to='c{}.in{}'/>\n", n % 1000, (n + 1) % 1000, n / 1000)
        })
        .collect();
    let file = format!("<armor version='1'><system>\n{components}{links}</system></armor>");
    let reading = read(Path::new("a.xml"), &mut |_| Ok(file.clone().into()));
    let reading = check(reading, &[], None);
    assert!(reading.findings.is_empty(), "{}", reading.findings.render(Colours::No));
    assert_eq!(reading.configuration.unwrap().system.links.len(), 3000);
}

const WORDS: &[&str] = &[
    "<armor version=\"1\">",
    "</armor>",
    "<system>",
    "</system>",
    "<mission safe=\"a\">",
    "</mission>",
    "<component name=\"a\" kind=\"k\">",
    "</component>",
    "<parameter name=\"p\" value=\"1\"/>",
    "<link from=\"a.x\" to=\"b.y\" keep=\"5\"/>",
    "<place name=\"a\" initial=\"true\"/>",
    "<transition name=\"t\" from=\"a b\" to=\"c\">",
    "</transition>",
    "<arc to=\"a\"/>",
    "<check>x</check>",
    "<mission system=\"gone\"/>",
    "<exclusive components=\"a b\"/>",
    "<layout><x/></layout>",
    "<",
    ">",
    "/>",
    "</",
    "<!--",
    "-->",
    "<![CDATA[",
    "]]>",
    "<?",
    "?>",
    "<!DOCTYPE",
    "&lt;",
    "&#x41;",
    "&#0;",
    "&",
    ";",
    "\"",
    "'",
    "=",
    " ",
    "\n",
    "\r\n",
    "\t",
    "ä",
    "\u{feff}",
    "\u{0}",
    "xmlns:a=\"b\"",
    "a:b=\"c\"",
    "x",
];

proptest! {
    #![proptest_config(ProptestConfig::with_cases(3000))]

    #[test]
    fn any_bytes(bytes in proptest::collection::vec(any::<u8>(), 0..400)) {
        spans_hold(&read_all(&bytes));
    }

    #[test]
    fn any_pieces_of_files(words in proptest::collection::vec(proptest::sample::select(WORDS), 0..60)) {
        spans_hold(&read_all(words.concat().as_bytes()));
    }

    #[test]
    fn an_example_with_any_change(
        at in 0.0f64..1.0,
        cut in 0usize..20,
        put in proptest::collection::vec(proptest::sample::select(WORDS), 0..3),
    ) {
        let example = include_str!("everything.xml");
        let start = example.floor_char_boundary((at * example.len() as f64) as usize);
        let end = example.floor_char_boundary((start + cut).min(example.len()));
        let changed = format!("{}{}{}", &example[..start], put.concat(), &example[end..]);
        spans_hold(&read_all(changed.as_bytes()));
    }
}
