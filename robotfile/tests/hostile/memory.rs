//! What the worst files cost: each is read, checked, shown, laid out and edited by a process of its
//! own, whose time is printed and whose memory is bounded.

use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::{Duration, Instant};

use armor_robotfile::{Colours, Document, MAX_FILE_BYTES, NewElement, check, format, load};

use crate::hostile::entry::manifests;

/// Of the whole process, in KiB.
const MOST_KIB: u64 = 64 << 10;
/// Far beyond what any of it takes (milliseconds); a hang or a quadratic walk does not pass it.
const DEADLINE: Duration = Duration::from_secs(20);
/// The file that a child is to work on.
const VARIABLE: &str = "ARMOR_HOSTILE_FILE";

/// A file of one piece over and over, with `#` in it the count, as many as fit 1 MiB.
fn filled(head: &str, piece: &str, tail: &str) -> Vec<u8> {
    let mut out = String::from(head);
    for n in 0.. {
        let piece = piece.replace('#', &n.to_string());
        if out.len() + piece.len() + tail.len() > MAX_FILE_BYTES {
            break;
        }
        out += &piece;
    }
    (out + tail).into_bytes()
}

const SYSTEM: &str = "<armor version='1'><system>";
const SYSTEM_END: &str = "</system></armor>";
const ONE: &str = "<armor version='1'><system><component name='a' kind='k'/>";
const MISSION: &str = "<armor version='1'><system><component name='a' kind='k'/>\
    <component name='b' kind='k'/></system><mission safe='p0' goal='p0'>";
const MISSION_END: &str = "</mission></armor>";

/// Name, head, piece, tail.
const FILLED: &[(&str, &str, &str, &str)] = &[
    ("nested", "", "<a>", ""),
    ("empty elements", "<a>", "<b/>", "</a>"),
    ("pairs of tags", "<a>", "<b></b>", "</a>"),
    ("end tags", "<a>", "</b>", ""),
    ("unclosed", "<armor version='1'><system>", "<x>", ""),
    ("less than", "", "<", ""),
    ("greater than", "<a>", ">", "</a>"),
    ("ampersands", "<a>", "&", "</a>"),
    ("entities", "<a>", "&lt;", "</a>"),
    ("character references", "<a b='", "&#65;", "'/>"),
    ("unknown entities", "<a>", "&x;", "</a>"),
    ("comments", "<a>", "<!---->", "</a>"),
    ("dashes", "<a><!--", "- ", "--></a>"),
    ("character data", "<a>", "<![CDATA[]]>", "</a>"),
    ("instructions", "<a>", "<?x?>", "</a>"),
    ("declarations", "", "<?xml version='1.0'?>", ""),
    ("attributes", "<armor version='1'", " a#=''", "/>"),
    ("one attribute", "<armor version='1'", " a=''", "/>"),
    ("namespaces", "<armor version='1'", " xmlns:n#='u'", "/>"),
    (
        "elements of 64 attributes",
        "<a>",
        "<b a='' c='' d='' e='' f='' g='' h='' i='' j='' k='' l='' m='' n='' o='' p=''/>",
        "</a>",
    ),
    ("quotes", "<a b=", "\"", "/>"),
    ("spaces", "<a ", " ", "/>"),
    ("lines", "<armor version='1'>\n", "\n", "<system/></armor>"),
    ("bells", "<a>", "\u{7}", "</a>"),
    ("text", "<armor version='1'><system>", "word ", SYSTEM_END),
    ("a long name", "<", "a", "/>"),
    ("a long value", "<armor version='", "1", "'/>"),
    (
        "a long component",
        "<armor version='1'><system><component name='",
        "a",
        "' kind='k'/></system></armor>",
    ),
    ("components", SYSTEM, "<component name='c#' kind='k'/>", SYSTEM_END),
    ("one component", SYSTEM, "<component name='c' kind='k'/>", SYSTEM_END),
    ("unknown kinds", SYSTEM, "<component name='c#' kind='k#'/>", SYSTEM_END),
    (
        "parameters",
        "<armor version='1'><system><component name='a' kind='k'>",
        "<parameter name='p#' value='1'/>",
        "</component></system></armor>",
    ),
    ("links", ONE, "<link from='a.out' to='a.in'/>", SYSTEM_END),
    ("links of strangers", ONE, "<link from='x#.out' to='y#.in'/>", SYSTEM_END),
    (
        "links of long strangers",
        ONE,
        "<link from='aaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaa#.out' to='a.in'/>",
        SYSTEM_END,
    ),
    ("places", MISSION, "<place name='p#' initial='true' components='a'/>", MISSION_END),
    ("places of strangers", MISSION, "<place name='p#' components='x# y#'/>", MISSION_END),
    (
        "a place of many components",
        "<armor version='1'><system/><mission safe='p'><place name='p' components='",
        "c# ",
        "'/></mission></armor>",
    ),
    (
        "a place of one component",
        "<armor version='1'><system/><mission safe='p'><place name='p' components='",
        "c ",
        "'/></mission></armor>",
    ),
    ("exclusions", MISSION, "<exclusive components='a b'/>", MISSION_END),
    (
        "an exclusion",
        "<armor version='1'><system/><mission safe='p'><exclusive components='",
        "c# ",
        "'/></mission></armor>",
    ),
    ("transitions", MISSION, "<transition name='t#' from='p#' to='p0' on='a.done'/>", MISSION_END),
    (
        "a transition of many places",
        "<armor version='1'><system/><mission safe='p'><transition name='t' from='",
        "p# ",
        "' to='p'/></mission></armor>",
    ),
    (
        "arcs",
        "<armor version='1'><system/><mission safe='p'><place name='p'/><transition name='t'>",
        "<arc from='p' weight='2'/>",
        "</transition></mission></armor>",
    ),
    (
        "a guard of brackets",
        "<armor version='1'><system/><mission><transition name='t' when='",
        "(",
        "'/></mission></armor>",
    ),
    (
        "a guard of signs",
        "<armor version='1'><system/><mission><transition name='t' when='",
        "- not ",
        "'/></mission></armor>",
    ),
    ("checks", MISSION, "<check>always reachable(p)</check>", MISSION_END),
    (
        "a check of brackets",
        "<armor version='1'><system/><mission><check>",
        "(",
        "</check></mission></armor>",
    ),
    (
        "blocks",
        "<armor version='1'><system><layout>",
        "<block of='c#' x='1' y='2'/>",
        "</layout></system></armor>",
    ),
    ("sub-missions", MISSION, "<submission ref='s#.xml' in='p0' out='p0'/>", MISSION_END),
    ("variables", MISSION, "<variable name='v#' source='a.out' min='0' max='1'/>", MISSION_END),
    ("systems", "<armor version='1'>", "<system/>", "</armor>"),
    ("foreign attributes", "<armor version='1' xmlns:m='u'>", "<system m:a='#'/>", "</armor>"),
];

/// As many zones, rally points, steps and exits as are allowed, all in each other's way.
fn drawing() -> Vec<u8> {
    let mut out =
        String::from(MISSION) + "<map><point name='p' at='0 0'/><point name='q' at='9 9'/>";
    for n in 0..256 {
        out += &format!("<zone name='z{n}' kind='no-go' margin='1m' shape='");
        for corner in 0..8 {
            let angle = f64::from(corner) * 0.7 + f64::from(n);
            out += &format!("{:.3},{:.3} ", 20.0 * angle.cos(), 20.0 * angle.sin());
        }
        out += "'/>";
    }
    for n in 0..16 {
        out += &format!("<rally name='r{n}' at='{n} -{n}'/>");
    }
    out += "</map>";
    for route in 0..8 {
        out += &format!("<route name='r{route}' mover='a.route' start='p'>");
        for n in 0..32 {
            out += &format!("<leg name='a{n}' to='q' by='1s'/><leg name='b{n}' to='p' by='1s'/>");
        }
        out += &"<otherwise on='blocked late recall lost-link' do='rally'/>".repeat(16);
        out += "</route>";
    }
    (out + MISSION_END).into_bytes()
}

/// Files that are not one piece over and over.
fn others() -> Vec<(&'static str, Vec<u8>)> {
    let mut laughs = String::from("<!DOCTYPE lolz [<!ENTITY lol0 \"lol\">");
    for n in 1..10 {
        let ten = format!("&lol{};", n - 1).repeat(10);
        laughs += &format!("<!ENTITY lol{n} \"{ten}\">");
    }
    laughs += "]><armor version=\"1\">&lol9;</armor>";
    let attributes: String = (0..80_000).map(|n| format!(" a{n}=''")).collect();
    vec![
        ("a billion laughs", laughs.into_bytes()),
        ("2,000,000 nested tags", "<a>".repeat(2_000_000).into_bytes()),
        ("80,000 attributes", format!("<armor version='1'{attributes}/>").into_bytes()),
        ("zeros", vec![0; 16 << 20]),
        ("no UTF-8", vec![0xff; MAX_FILE_BYTES]),
        ("the worst of everything", everything()),
        ("a drawing", drawing()),
    ]
}

/// As many components, places and transitions as are allowed, each with something wrong.
fn everything() -> Vec<u8> {
    let mut out = String::from("<armor version='1'><system>");
    for n in 0..4000 {
        out += &format!("<component name='c{n}' kind='k{n}'/>");
    }
    for n in 0..4000 {
        out += &format!("<link from='c{n}.x' to='d{n}.y'/>");
    }
    out += "</system><mission safe='x'>";
    for n in 0..4000 {
        out += &format!("<place name='p{n}' components='c{n} e{n}'/>");
    }
    for n in 0..4000 {
        out += &format!("<transition name='t{n}' from='p{n}' to='q{n}'/>");
    }
    (out + "</mission></armor>").into_bytes()
}

#[test]
fn the_worst_files_cost_milliseconds_and_little_memory() {
    let folder = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join("hostile");
    std::fs::create_dir_all(&folder).expect("writable");
    let filled = FILLED.iter().map(|(name, head, piece, tail)| (*name, filled(head, piece, tail)));
    let (mut most_kib, mut most_ms) = ((0, ""), (0.0, ""));
    let all: Vec<_> = filled.chain(others()).collect();
    for (n, (name, bytes)) in all.iter().enumerate() {
        let file = folder.join(format!("{n}.xml"));
        std::fs::write(&file, bytes).expect("writable");
        let (ms, kib, codes) = work_of_a_child(&file, name);
        println!("{ms:7.1} ms {:5.1} MiB  {name}: {codes}", kib as f64 / 1024.0);
        assert!(kib < MOST_KIB, "{name}: {kib} KiB");
        most_kib = most_kib.max((kib, name));
        most_ms = if ms > most_ms.0 { (ms, name) } else { most_ms };
        std::fs::remove_file(&file).expect("it is there");
    }
    println!("{} files: at most {most_ms:?} ms, {most_kib:?} KiB", all.len());
}

/// Milliseconds, KiB, and the codes found.
fn work_of_a_child(file: &Path, name: &str) -> (f64, u64, String) {
    let started = Instant::now();
    let output = Command::new(std::env::current_exe().expect("this test"))
        .args(["--exact", "hostile::memory::child", "--nocapture"])
        .env(VARIABLE, file)
        .output()
        .expect("it starts");
    assert!(started.elapsed() < DEADLINE, "{name}: {:?}", started.elapsed());
    let text = String::from_utf8_lossy(&output.stdout);
    assert!(output.status.success(), "{name}: {text}{}", String::from_utf8_lossy(&output.stderr));
    let line = text.lines().find_map(|line| line.split_once("COST ")).expect("it says").1;
    let mut words = line.splitn(3, ' ');
    let mut next = || words.next().unwrap_or_default();
    (next().parse().expect("ms"), next().parse().expect("KiB"), next().to_owned())
}

/// Reads the file that the environment names; without one it does nothing.
#[test]
fn child() {
    let Some(file) = std::env::var_os(VARIABLE).map(PathBuf::from) else { return };
    let kinds = manifests();
    let started = Instant::now();
    let reading = check(load(&file), &[], Some(kinds));
    let shown = reading.findings.render(Colours::Yes);
    let json = serde_json::to_string(&reading.findings.iter().collect::<Vec<_>>());
    let ms = started.elapsed().as_secs_f64() * 1e3;
    assert!(!shown.is_empty() || reading.is_valid());
    drop((shown, json));
    let mut codes: Vec<_> = reading.findings.iter().map(|found| found.code.as_str()).collect();
    codes.dedup();
    codes.truncate(6);
    let codes = codes.join(" ");
    drop(reading);
    let bytes = armor_robotfile::read_bytes(&file).expect("readable");
    drop(format(&file, &bytes));
    if let Ok(mut document) = Document::open(&file, &bytes) {
        let _ = document.insert_element(&[], 0, &NewElement::new("x"));
        let _ = document.set_parameter("a", "p1", Some("2"));
    }
    println!("COST {ms} {} {codes}", peak_kib());
}

/// The peak memory of this process.
fn peak_kib() -> u64 {
    let status = std::fs::read_to_string("/proc/self/status").expect("/proc");
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:")).expect("a peak");
    line.trim().trim_end_matches(" kB").parse().expect("a number")
}
