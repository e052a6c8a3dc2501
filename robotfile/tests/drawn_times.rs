//! The times of drawn routes: earliest and latest, slack, conflicts, circles of meetings, batteries.

use std::fmt::Write as _;
use std::path::Path;

use armor_robotfile::timing::{StraightLengths, Timetable};
use armor_robotfile::{Code, Date, Reading, check, read};

const SYSTEM: &str = "<system><component name='way' kind='patrol'/>\
    <component name='path' kind='patrol'/><component name='driver' kind='driver'>\
    <parameter name='speed' value='1m/s'/></component></system>";
const MARKS: &str = "<point name='P0' at='0 0'/><point name='P1' at='12 0'/>\
    <point name='P2' at='12 9'/><rally name='R1' at='6 6'/>";

/// A file with a route `red`, whose speeds are exact, and what else the mission has.
fn file(marks: &str, attributes: &str, steps: &str, more: &str) -> String {
    format!(
        "<armor version='1'>{SYSTEM}<mission goal='over' safe='hold'><map>{MARKS}{marks}</map>\
         <route name='red' mover='way.route' pace='driver.speed' start='P0' out='over' \
         {attributes}>{steps}</route>{more}<place name='over'/><place name='hold'/>\
         </mission></armor>"
    )
}

fn read_text(text: &str) -> Reading {
    let reading = read(Path::new("a.xml"), &mut |_| Ok(text.as_bytes().to_vec()));
    check(reading, &[], None)
}

/// The findings about times and batteries; the missions here are no more than routes.
fn codes(text: &str) -> Vec<Code> {
    let of_times = [
        Code::TimesConflict,
        Code::MeetingsInCircle,
        Code::TimeMayLack,
        Code::BatteryEmpty,
        Code::BatteryOpen,
    ];
    let findings = read_text(text).findings;
    findings.iter().map(|finding| finding.code).filter(|code| of_times.contains(code)).collect()
}

/// `l1 12..12 by 1 min: 48` for each step, in seconds.
fn times(text: &str, begin: Option<&str>) -> String {
    let reading = read_text(text);
    let configuration = reading.configuration.expect("a configuration");
    let mission = configuration.mission.expect("a mission");
    let begin = begin.map(|begin| begin.parse::<Date>().expect("a date"));
    let table = Timetable::of_mission(&mission, &configuration.system, &StraightLengths, begin);
    let mut out = String::new();
    for step in &table.steps {
        let seconds = |time: Option<std::time::Duration>| {
            time.map_or("?".into(), |time| format!("{}", time.as_secs_f64()))
        };
        let (earliest, latest) = (seconds(step.earliest), seconds(step.latest));
        write!(out, "{}.{} {earliest}..{latest}", step.route, step.step).unwrap();
        for limit in &step.limits {
            let slack = limit.slack_ns.map_or("?".into(), |ns| format!("{}", ns as f64 / 1e9));
            write!(out, " [{}: {slack}]", limit.words).unwrap();
        }
        out += "; ";
    }
    if let Some(date) = table.begin_by {
        write!(out, "begin by {date}").unwrap();
    }
    out.trim_end_matches("; ").to_owned()
}

#[test]
fn each_step_has_its_earliest_and_latest_time_and_its_slack() {
    let steps = "<leg name='l1' to='P1' speed='0.5m/s' by='1min'/><stay name='s1' for='30s'/>\
                 <leg name='l2' to='P2'/><stay name='s2' for='9s' on='way.waypoint'/>\
                 <stay name='s3' on='way.waypoint'/>";
    assert_eq!(
        times(&file("", "tolerance='0.25'", steps, ""), None),
        "red.l1 19.2..32 [by 1 min: 28]; red.s1 49.2..62; red.l2 56.4..74; red.s2 56.4..83; \
         red.s3 56.4..?"
    );
    let usual = times(&file("", "", steps, ""), None);
    assert!(usual.starts_with("red.l1 20..30 [by 1 min: 30]; "), "{usual}");
}

#[test]
fn a_slow_zone_takes_its_time() {
    let zone = "<zone name='slow' kind='speed' speed='0.1m/s' shape='3,-1 6,-1 6,1 3,1'/>";
    let leg = "<leg name='l1' to='P1' speed='1m/s'/>";
    // 3 m at a tenth of the speed, and the parts at both borders.
    let found = times(&file(zone, "tolerance='0%'", leg, ""), None);
    let latest: f64 = found.rsplit("..").next().unwrap().parse().unwrap();
    assert!((39.0..41.0).contains(&latest), "{found}");
    assert!(found.starts_with("red.l1 12.."), "{found}");
}

const GREEN: &str = "<line name='green' kind='phase' not-before='2099-01-01T12:00:00Z' \
                     shape='6,-5 6,5'/>";

#[test]
fn dates_are_known_with_the_date_of_the_begin() {
    let leg = "<leg name='l1' to='P1' speed='1m/s' not-after='2099-01-01T12:00:10Z'/>";
    let text = file(GREEN, "tolerance='0%'", leg, "");
    assert_eq!(
        times(&text, None),
        "red.l1 to green 6..? [not after 2099-01-01T12:00:10Z: 10]; \
         red.l1 12..? [not after 2099-01-01T12:00:10Z: 4]; begin by 2099-01-01T11:59:58Z"
    );
    assert_eq!(
        times(&text, Some("2099-01-01T11:59:00Z")),
        "red.l1 to green 60..60 [not after 2099-01-01T12:00:10Z: 10]; \
         red.l1 66..66 [not after 2099-01-01T12:00:10Z: 4]"
    );
    assert_eq!(
        times(&text, Some("2099-01-01T12:00:00Z")),
        "red.l1 to green 6..6 [not after 2099-01-01T12:00:10Z: 4]; \
         red.l1 12..12 [not after 2099-01-01T12:00:10Z: -2]"
    );
    assert_eq!(codes(&text), []);
}

#[test]
fn limits_that_exclude_each_other_are_one_finding_with_all_of_them() {
    let steps = "<leg name='l1' to='P1' speed='1m/s' not-before='2099-01-01T12:00:00Z'/>\
                 <stay name='s1' for='1min'/>\
                 <leg name='l2' to='P2' speed='1m/s' not-after='2099-01-01T12:01:05Z'/>";
    let reading = read_text(&file("", "tolerance='0%'", steps, ""));
    let found: Vec<_> = reading.findings.iter().collect();
    let [conflict] = found.as_slice() else { panic!("{found:?}") };
    assert_eq!(conflict.code, Code::TimesConflict);
    for part in [
        "4 s are missing: ",
        "red.l2 has not after 2099-01-01T12:01:05Z",
        "red.l1 does not continue before 2099-01-01T12:00:00Z",
        "red.s1 takes at least 1 min",
        "red.l2 takes at least 9 s",
    ] {
        assert!(conflict.message.contains(part), "{part} in {}", conflict.message);
    }
    // A leg that is too slow for its time in every run.
    let slow = "<leg name='l1' to='P1' speed='0.1m/s' by='1min'/>";
    assert_eq!(codes(&file("", "", slow, "")), [Code::TimesConflict]);
    // One that may be.
    let may = "<leg name='l1' to='P1' speed='0.2m/s' by='1min'/>";
    assert_eq!(codes(&file("", "", may, "")), [Code::TimeMayLack]);
}

fn blue(steps: &str) -> String {
    format!(
        "<route name='blue' mover='path.route' pace='driver.speed' start='P0' tolerance='0%'>\
         {steps}</route>"
    )
}

#[test]
fn a_meeting_is_when_both_are_there_and_the_first_waits() {
    let red = "<leg name='l1' to='P1' speed='1m/s'/><meet name='m' with='blue' patience='20s'/>\
               <leg name='l2' to='P2' speed='1m/s'/>";
    let other = blue("<leg name='l1' to='P1' speed='0.5m/s'/><meet name='n' with='red'/>");
    assert_eq!(
        times(&file("", "tolerance='0%'", red, &other), None),
        "red.l1 12..12; red.m 24..24 [patience 20 s: 8]; red.l2 33..33; blue.l1 24..24; \
         blue.n 24..24"
    );
    let slow = blue("<leg name='l1' to='P1' speed='0.3m/s'/><meet name='n' with='red'/>");
    assert_eq!(codes(&file("", "tolerance='0%'", red, &slow)), [Code::TimesConflict]);
    let hasty = red.replace("20s", "15s");
    assert_eq!(codes(&file("", "tolerance='80%'", &hasty, &other)), [Code::TimeMayLack]);
}

#[test]
fn what_passed_before_a_common_meeting_does_not_add_to_a_wait() {
    let long = "<leg name='l1' to='P1' speed='0.01m/s'/><meet name='m' with='blue'/>\
                <leg name='l2' to='P2' speed='1m/s'/><meet name='m2' with='blue' patience='2s'/>";
    let other = blue(
        "<meet name='n' with='red'/><stay name='s' for='9s'/>\
                      <meet name='n2' with='red'/>",
    );
    // Up to 12,000 s uncertain before the first meeting, and at most 1.5 s between the two.
    let found = times(&file("", "tolerance='10%'", long, &other), None);
    assert!(found.contains("red.m2") && found.contains("[patience 2 s: 1.18"), "{found}");
}

#[test]
fn meetings_in_a_circle_are_found() {
    let red =
        "<meet name='m1' with='blue' patience='9s'/><meet name='m2' with='green' patience='9s'/>";
    let others = |first: &str, second: &str| {
        format!(
            "{}<route name='green' mover='driver.route' start='P0'>\
             <meet name='g1' with='red' patience='9s'/><meet name='g2' with='blue' patience='9s'/>\
             </route>",
            blue(&format!(
                "<meet name='b1' with='{first}' patience='9s'/>\
                 <meet name='b2' with='{second}' patience='9s'/>"
            ))
        )
    };
    let circle = file("", "", red, &others("green", "red"));
    let reading = read_text(&circle);
    let found: Vec<_> =
        reading.findings.iter().filter(|it| it.code == Code::MeetingsInCircle).collect();
    let [finding] = found.as_slice() else { panic!("{:?}", reading.findings) };
    for meeting in ["red.m1 with blue.b2", "red.m2 with green.g1", "blue.b1 with green.g2"] {
        assert!(finding.message.contains(meeting), "{}", finding.message);
    }
    assert!(!codes(&file("", "", red, &others("red", "green"))).contains(&Code::MeetingsInCircle));
}

#[test]
fn a_battery_lasts_to_the_rally_point_of_every_step() {
    let steps = "<leg name='l1' to='P1' speed='1m/s' by='1min'/><stay name='s1' for='30s'/>\
                 <otherwise on='blocked late recall' do='rally'/>";
    let with = |attributes: &str| codes(&file("", attributes, steps, ""));
    // 15 s to P1, 30 s there, and 8.5 m at 0.8 m/s: 55.6 s.
    assert_eq!(with("endurance='55s'"), [Code::BatteryEmpty]);
    assert_eq!(with("endurance='56s'"), []);
    // The drive is given up after a second.
    assert_eq!(with("endurance='46s' rally-by='1s'"), []);
    let open = "<leg name='l1' to='P1' speed='1m/s' by='1min'/><stay name='s1' on='way.waypoint'/>";
    assert_eq!(codes(&file("", "endurance='1h'", open, "")), [Code::BatteryOpen]);
    let reading = read_text(&file("", "endurance='55s'", steps, ""));
    let empty = reading.findings.iter().find(|finding| finding.code == Code::BatteryEmpty);
    let message = &empty.unwrap().message;
    assert!(message.contains("at the end of red.s1") && message.contains("R1"), "{message}");
}
