//! Whatever the bytes: an answer, soon, in bounded memory, with spans inside the file.

mod entry;
mod input;
#[path = "../../fuzz/kept_corpus.rs"]
mod kept_corpus;
mod memory;

use std::path::Path;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::mpsc::channel;
use std::time::{Duration, Instant};

use armor_robotfile::{Colours, MAX_FINDINGS, check, read};

use entry::{ENTRIES, EXAMPLES, read_all, spans_hold};
use input::input;

fn refused(code: &str, bytes: &[u8]) {
    let reading = read_all(bytes);
    spans_hold(&reading);
    let codes: Vec<_> = reading.findings.iter().map(|finding| finding.code.as_str()).collect();
    assert!(codes.contains(&code), "{codes:?}");
    assert!(!reading.is_valid());
}

/// Inputs that are kept of each reader, next to the examples, and the longest of them in bytes.
const KEPT: usize = 24;
const KEPT_LEN: usize = 1 << 10;

#[test]
fn the_kept_inputs_of_every_reader_get_an_answer() {
    let make = || -> Vec<Vec<u8>> {
        let inputs = (0..10_000).map(|number| input(0x5eed, number));
        let short = inputs.filter(|input| input.len() <= KEPT_LEN).take(KEPT);
        EXAMPLES.iter().map(|text| text.as_bytes().to_vec()).chain(short).collect()
    };
    for (name, run) in ENTRIES {
        kept_corpus::run_corpus(name, run, make);
    }
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

/// Inputs and the time in which they have to fit: under `ARMOR_FULL`, under `CI`, and else.
const MOST: (u64, Duration) = (1_000_000, Duration::from_secs(120));
const MANY: (u64, Duration) = (200_000, Duration::from_secs(20));
const SOME: (u64, Duration) = (20_000, Duration::from_secs(6));
/// One input of so many goes through everything.
const OTHERS: u64 = 8;
const SEED: &str = "ARMOR_SEED";
/// Far beyond what one input takes.
const HANGS: Duration = Duration::from_secs(60);

#[test]
fn any_input_gets_an_answer() {
    let is_set = |name: &str| std::env::var_os(name).is_some();
    let (count, time) = match (is_set("ARMOR_FULL"), is_set("CI")) {
        (true, _) => MOST,
        (false, true) => MANY,
        (false, false) => SOME,
    };
    let seed = std::env::var(SEED).ok().and_then(|seed| seed.parse().ok()).unwrap_or(1);
    println!("seed {seed}; {SEED}={seed} makes the same inputs again");
    let next: &'static AtomicU64 = Box::leak(Box::new(AtomicU64::new(0)));
    let threads = std::thread::available_parallelism().map_or(1, usize::from).min(4);
    let (done, answers) = channel();
    let started = Instant::now();
    for _ in 0..threads {
        let done = done.clone();
        std::thread::spawn(move || {
            while started.elapsed() < time {
                let number = next.fetch_add(1, Ordering::Relaxed);
                if number >= count {
                    break;
                }
                let fault =
                    std::panic::catch_unwind(|| try_all(number, &input(seed, number))).err();
                if fault.is_some() && done.send(Some(number)).is_err() {
                    return;
                }
            }
            let _ = done.send(None);
        });
    }
    let (mut ended, mut faults) = (0, Vec::new());
    while ended < threads {
        match answers.recv_timeout(time + HANGS) {
            Ok(None) => ended += 1,
            Ok(Some(number)) => faults.push(number),
            Err(_) => panic!("one of the inputs before {} hangs", next.load(Ordering::Relaxed)),
        }
    }
    let tried = next.load(Ordering::Relaxed).min(count);
    println!("{tried} inputs in {:.1} s", started.elapsed().as_secs_f64());
    for number in faults.iter().take(3) {
        let name = format!("hostile-{seed}-{number}.xml");
        let path = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
        std::fs::write(&path, input(seed, *number)).unwrap();
        eprintln!("input {number} of seed {seed} is in {}", path.display());
    }
    assert!(faults.is_empty(), "inputs {faults:?} of seed {seed}");
}

/// Every input is read and checked; one of [`OTHERS`] is also laid out and edited, which reads it
/// several times more.
fn try_all(number: u64, bytes: &[u8]) {
    let all = number.is_multiple_of(OTHERS);
    for (_, entry) in ENTRIES.iter().take(if all { ENTRIES.len() } else { 1 }) {
        entry(bytes);
    }
    if all {
        // The input as a file that is edited, by orders that come from it.
        let orders = bytes.iter().copied().chain(std::iter::repeat(b'7')).take(22);
        let file: Vec<u8> = orders.chain(bytes.iter().copied()).collect();
        entry::edits(&file);
    }
}
