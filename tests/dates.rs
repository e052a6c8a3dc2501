//! Appointments at absolute dates, with real processes: the executive is killed while they wait,
//! and they are refused on a host without a synchronized clock.

use std::path::Path;
use std::time::Duration;

use armor_executive::journal::Journal;
use armor_executive::{Cause, JournalEntry, JournalRecord};
use armor_plan::DatePhase;
use armor_robotfile::Date;

use crate::fixture::{Folder, run_to_end, wait_for};
use crate::resilience::system::Draft;

/// Long enough for the mission to begin and for two kills of the executive, on a busy machine.
const SOON: Duration = Duration::from_secs(25);

fn records(journal: &Path) -> Vec<JournalRecord> {
    Journal::open(journal).expect("a journal").1.records
}

/// Returns the time, in mission time and in UTC, at which the date of `transition` first had the
/// phase `wanted`.
fn dated(
    records: &[JournalRecord],
    transition: &str,
    wanted: DatePhase,
) -> Option<(Duration, Date)> {
    records.iter().find_map(|record| match &record.entry {
        JournalEntry::Dated { transition: name, phase, utc, .. }
            if name == transition && *phase == wanted =>
        {
            Some((record.at, utc.parse().expect("a date")))
        }
        _ => None,
    })
}

fn taken(records: &[JournalRecord], transition: &str) -> Option<Duration> {
    let takes = |record: &&JournalRecord| matches!(&record.entry, JournalEntry::Took { cause: Cause::Transition(name), .. } if name == transition);
    records.iter().find(takes).map(|record| record.at)
}

fn mission(meet: &str) -> String {
    format!(
        "<mission name='rendezvous' goal='home' safe='hold'>
           <place name='wait' initial='true' components='radio'/>
           <place name='home'/>
           <place name='hold'/>
           <transition name='meet' from='wait' to='home' {meet}/>
         </mission>"
    )
}

fn draft(meet: &str) -> Draft {
    Draft::default().probe("radio", "rate='20Hz'", "").mission(&mission(meet))
}

// Slow (25 s): it waits for an absolute date, which no setting can bring nearer.
#[test]
fn an_appointment_is_kept_despite_kills_of_the_executive() {
    let date = armor_executive::utc().later(SOON);
    let draft = draft(&format!("not-before='{date}'"));
    let mut system = draft.run_with(Folder::new("rendezvous"), &["--trust-clock"]);
    for _ in 0..2 {
        let words = format!("meet waits until {date}, in ");
        wait_for(&words, || system.shown(&["mission", "show"]).contains(&words).then_some(()));
        system.replace("executive");
    }
    let code = system.run.code();
    assert_eq!(code, Some(0), "{}", system.run.log());
    let records = records(&system.run.out().join("executive.journal"));
    let (open, utc) = dated(&records, "meet", DatePhase::Open).expect("its date has come");
    assert!(utc >= date && armor_executive::utc() >= date, "{utc} before {date}");
    assert!(taken(&records, "meet").is_some_and(|taken| taken >= open));
    assert_eq!(system.trace("radio").count("stopping"), 1, "never disturbed before");
}

// Slow (25 s): it waits for an absolute date, which no setting can bring nearer.
#[test]
fn a_date_that_passes_fails_its_mission() {
    let date = armor_executive::utc().later(SOON);
    let meet = format!("not-after='{date}' missed='fail' on='radio.ticked'");
    let mut system = draft(&meet).run_with(Folder::new("missed"), &["--trust-clock"]);
    let code = system.run.code();
    let log = system.run.log();
    assert_eq!(code, Some(1), "{log}");
    let words = format!("retreats: the date of `meet` has passed unused: {date}");
    assert!(log.contains(&words), "{log}");
}

#[test]
fn dates_need_a_synchronized_clock_and_past_ones_are_a_warning() {
    let folder = Folder::new("no-clock");
    let text = format!(
        "<armor version='1'><system/>{}</armor>",
        mission("not-after='2024-06-01T12:00:00Z'").replace(" components='radio'", "")
    );
    folder.write("robot.xml", &text);
    let (code, _, err) = run_to_end(&mut folder.armor(&["check", "robot.xml"]));
    assert_eq!(code, 0, "{err}");
    let words = "warning[W0223]: 2024-06-01T12:00:00Z has passed: meet never fires";
    assert!(err.contains(words), "{err}");
    // With an empty folder as `PATH`, the executive finds no program that reports the clock's
    // state.
    let without_services = folder.path().join("empty");
    std::fs::create_dir_all(&without_services).expect("writable");
    let mut run = folder.armor(&["run", "robot.xml", "--out", "out"]);
    if armor_executive::clock_doubts().is_none() {
        println!("skipped: a time service keeps the clock of this machine");
        return;
    }
    let (code, _, err) = run_to_end(run.env("PATH", &without_services));
    assert_eq!(code, 1, "{err}");
    assert!(err.contains("is not known to be right (there is no timedatectl; "), "{err}");
    assert!(err.contains("--trust-clock"), "{err}");
}

/// `missions/appointment.xml` with a date in the future.
// Slow (45 s): the date comes after the first leg, which is driven in real time.
#[test]
fn the_appointment_is_waited_for_between_two_legs() {
    let missions = Path::new(env!("CARGO_MANIFEST_DIR")).join("../missions");
    let folder = Folder::new("appointment");
    let text = std::fs::read_to_string(missions.join("appointment.xml")).expect("the example");
    let date = armor_executive::utc().later(Duration::from_secs(45));
    let rooms = missions.join("worlds/rooms.svg").display().to_string();
    let text = text.replace("2024-06-01T12:00:00Z", &date.to_string());
    assert!(text.contains(&date.to_string()), "the example has another date");
    folder.write("appointment.xml", &text.replace("worlds/rooms.svg", &rooms));
    let arguments = ["run", "appointment.xml", "--headless", "--out", "out", "--trust-clock"];
    let (code, log, err) = run_to_end(&mut folder.armor(&arguments));
    assert_eq!(code, 0, "{log}{err}");
    let records = records(&folder.path().join("out/executive.journal"));
    let (open, utc) = dated(&records, "appointed", DatePhase::Open).expect("it has come");
    assert!(utc >= date, "{utc} before {date}");
    assert!(taken(&records, "appointed").is_some_and(|taken| taken >= open));
}
