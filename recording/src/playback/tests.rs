//! Tests of what is played when, without a file, a system and a clock.

use std::collections::{BTreeMap, BTreeSet};
use std::time::Duration;

use armor_sdk::control::{InputStatus, LinkStatus, OutputStatus, RunState, Status};
use armor_wire::keep::Keep;

use super::followers::DeliveryCheck;
use super::pace::{PlaybackPace, PlaybackSpeed};
use super::queue::{DataRename, MessageSource, PlaybackQueue};
use super::schedule::{PlaybackStep, PlayedPart, Schedule};
use crate::head::MessageHead;
use crate::message_stream::{ReadError, RecordedMessage};
use crate::taps::OutputSelection;
use crate::writer::OutputType;

/// Messages in the order of a file.
struct Messages {
    all: Vec<RecordedMessage>,
    next: usize,
}

impl MessageSource for Messages {
    fn next_message(&mut self) -> Result<Option<RecordedMessage>, ReadError> {
        self.next += 1;
        Ok(self.all.get(self.next - 1).cloned())
    }

    fn seek(
        &mut self,
        stamp_s: f64,
        latched: &BTreeSet<String>,
    ) -> Result<BTreeMap<String, RecordedMessage>, ReadError> {
        // As a file with chunks of one second.
        let chunk_s = stamp_s.floor();
        let at = self.all.iter().position(|message| message.head.stamp_s >= chunk_s);
        self.next = at.unwrap_or(self.all.len());
        let before = self.all.iter().filter(|it| it.head.stamp_s < stamp_s);
        let held = before.filter(|message| latched.contains(&message.data));
        Ok(held.map(|message| (message.data.clone(), message.clone())).collect())
    }
}

fn message(data: &str, stamp_s: f64) -> RecordedMessage {
    let latched = data.ends_with("map");
    RecordedMessage {
        data: data.into(),
        output_type: OutputType { latched, ..OutputType::default() },
        head: MessageHead { stamp_s, ..MessageHead::default() },
        payload: Ok(vec![0; 8]),
    }
}

fn queue(recorded: &[(&str, f64)]) -> PlaybackQueue<Messages> {
    let all: Vec<_> = recorded.iter().map(|(data, stamp_s)| message(data, *stamp_s)).collect();
    let latched = all.iter().filter(|message| message.output_type.latched);
    let latched = latched.map(|message| message.data.clone()).collect();
    let renames = vec!["b.x=c.y".parse::<DataRename>().unwrap()];
    let selection = OutputSelection { exclude: vec!["d.*".into()], ..OutputSelection::default() };
    PlaybackQueue::new(Messages { all, next: 0 }, selection, renames, latched)
}

fn drain(queue: &mut PlaybackQueue<Messages>) -> Vec<(String, f64)> {
    let mut played = Vec::new();
    while queue.peek().unwrap().is_some() {
        let taken = queue.take().unwrap();
        played.push((taken.message.data, taken.due_s));
    }
    played
}

fn at(seconds: f64) -> Duration {
    Duration::from_secs_f64(seconds)
}

#[test]
fn messages_come_by_their_stamps_under_their_new_names() {
    let mut queue = queue(&[("a.x", 1.0), ("b.x", 1.2), ("a.x", 1.1), ("d.x", 1.1), ("a.x", 1.2)]);
    queue.seek(1.0).unwrap();
    let played = drain(&mut queue);
    let expected = [("a.x", 1.0), ("a.x", 1.1), ("c.y", 1.2), ("a.x", 1.2)];
    assert_eq!(played, expected.map(|(data, due_s)| (data.to_owned(), due_s)));
}

#[test]
fn what_outputs_held_is_played_at_the_beginning() {
    let recorded = [
        ("a.map", 0.5),
        ("a.x", 1.0),
        ("b.x", 1.6),
        ("a.map", 2.0),
        ("b.x", 2.1),
        ("a.x", 3.0),
        ("a.map", 4.0),
    ];
    let mut queue = queue(&recorded);
    queue.seek(2.5).unwrap();
    let expected = [("a.map", 2.5), ("c.y", 2.5), ("a.x", 3.0), ("a.map", 4.0)];
    assert_eq!(drain(&mut queue), expected.map(|(data, due_s)| (data.to_owned(), due_s)));
    queue.seek(0.0).unwrap();
    assert_eq!(drain(&mut queue).len(), recorded.len(), "and back");
}

fn schedule(
    recorded: &[(&str, f64)],
    speed: PlaybackSpeed,
    is_lossless: bool,
) -> Schedule<Messages> {
    let part = PlayedPart { from_s: 1.0, to_s: recorded.last().map_or(1.0, |it| it.1) };
    let pace = PlaybackPace::new(1.0, speed, false, Duration::ZERO);
    let mut schedule = Schedule::new(queue(recorded), part, pace, is_lossless).unwrap();
    schedule.set_followed(["a.x".to_owned()].into());
    schedule
}

/// What is published at this moment, as text: `@` is a time, `.` a wait for the system.
fn play(schedule: &mut Schedule<Messages>, now_s: f64) -> String {
    let mut played = Vec::new();
    loop {
        match schedule.next_step(at(now_s)).unwrap() {
            PlaybackStep::Clock(clock_s) => played.push(format!("@{clock_s:.2}")),
            PlaybackStep::Message(queued) => played.push(queued.message.data),
            PlaybackStep::AwaitTaken => {
                played.push(".".into());
                schedule.mark_taken();
            }
            PlaybackStep::Wait(_) => return played.join(" "),
            PlaybackStep::Over => {
                played.push("over".into());
                return played.join(" ");
            }
        }
    }
}

#[test]
fn time_passes_in_short_steps_and_before_each_message() {
    let recorded = [("a.x", 1.0), ("a.x", 1.015), ("a.z", 1.03)];
    let mut schedule = schedule(&recorded, PlaybackSpeed::Times(2.0), false);
    assert_eq!(play(&mut schedule, 0.0), "@1.00 a.x");
    assert_eq!(play(&mut schedule, 0.005), "@1.01");
    assert_eq!(play(&mut schedule, 0.0075), "@1.01 a.x", "at 1.015 s");
    assert_eq!(play(&mut schedule, 0.0125), "@1.02");
    assert_eq!(play(&mut schedule, 0.015), "@1.03 a.z over");
}

#[test]
fn the_system_has_taken_everything_before_time_passes_or_the_next_message_comes() {
    let recorded = [("a.x", 1.0), ("a.x", 1.02), ("a.x", 1.1)];
    let mut schedule = schedule(&recorded, PlaybackSpeed::Unlimited, true);
    let expected = "@1.00 . a.x . @1.01 . @1.02 . a.x . @1.03 . @1.04 . @1.05 . @1.06 . @1.07 . @1.08 . \
                    @1.09 . @1.10 . a.x . over";
    assert_eq!(play(&mut schedule, 0.0), expected);
}

#[test]
fn no_time_passes_before_what_follows_from_a_report() {
    let recorded =
        [("a.z", 1.0), ("armor.reports", 1.005), ("armor.reports", 1.005), ("a.z", 1.01)];
    let mut schedule = schedule(&recorded, PlaybackSpeed::Unlimited, true);
    let expected = "@1.00 a.z . @1.00 . armor.reports . armor.reports . @1.01 a.z . over";
    assert_eq!(play(&mut schedule, 0.0), expected);
}

#[test]
fn a_pause_stops_time_and_a_step_lets_it_pass() {
    let recorded = [("a.x", 1.0), ("a.x", 1.02), ("a.x", 1.04), ("a.x", 1.06)];
    let mut schedule = schedule(&recorded, PlaybackSpeed::Times(1.0), false);
    assert_eq!(play(&mut schedule, 0.0), "@1.00 a.x");
    schedule.pause();
    assert_eq!(play(&mut schedule, 9.0), "");
    schedule.step(0.0, at(9.0)).unwrap();
    assert_eq!(play(&mut schedule, 9.01), "@1.01");
    assert_eq!(play(&mut schedule, 9.5), "@1.02 a.x", "to the next message");
    assert!(schedule.pace().is_paused());
    schedule.step(0.008, at(9.5)).unwrap();
    assert_eq!(play(&mut schedule, 10.0), "@1.03", "between two messages");
    assert!(schedule.pace().is_paused());
    schedule.resume(at(20.0));
    assert_eq!(play(&mut schedule, 20.005), "", "the pause is not made up for");
    assert_eq!(play(&mut schedule, 20.0121), "@1.04 @1.04 a.x");
    schedule.seek(1.02, at(30.0)).unwrap();
    assert_eq!(play(&mut schedule, 30.0), "@1.02 a.x a.x", "back, with what was published before");
    schedule.seek(99.0, at(30.0)).unwrap();
    assert_eq!(play(&mut schedule, 30.0), "@1.06 a.x a.x over", "no further than the end");
}

#[test]
fn a_pause_at_the_end_lasts_until_time_passes_again() {
    let recorded = [("a.x", 1.0), ("a.x", 1.06)];
    let mut schedule = schedule(&recorded, PlaybackSpeed::Times(1.0), false);
    schedule.seek(1.06, at(0.0)).unwrap();
    schedule.pause();
    assert_eq!(play(&mut schedule, 9.0), "@1.06 a.x a.x", "and what was published before");
    schedule.step(0.0, at(9.0)).unwrap();
    assert_eq!(play(&mut schedule, 99.0), "", "there is no next message");
    schedule.step(5.0, at(99.0)).unwrap();
    assert_eq!(play(&mut schedule, 200.0), "", "nor more time");
    assert!(schedule.pace().is_paused());
    schedule.resume(at(200.0));
    assert_eq!(play(&mut schedule, 200.0), "over");
}

#[test]
fn what_is_late_stays_late_and_speeds_have_names() {
    let mut pace = PlaybackPace::new(0.0, PlaybackSpeed::Times(10.0), false, Duration::ZERO);
    assert_eq!(pace.time_until(10.0, Duration::ZERO), Some(at(1.0)));
    pace.reach(1.0, at(5.0));
    assert_eq!(pace.time_until(2.0, at(5.0)), Some(at(0.1)));
    pace.set_speed(PlaybackSpeed::Unlimited, at(5.0));
    assert_eq!(pace.time_until(1e9, at(5.0)), Some(Duration::ZERO));
    let read = |text: &str| text.parse::<PlaybackSpeed>();
    assert_eq!(read("max"), Ok(PlaybackSpeed::Unlimited));
    assert!(read("0").is_err_and(|text| text.contains("stand still")));
    assert_eq!(read("2.5x"), Ok(PlaybackSpeed::Times(2.5)));
    for wrong in ["-1", "-0", "0x", "fast", "inf", "NaN", ""] {
        assert!(read(wrong).is_err(), "{wrong}");
    }
}

fn outputs(sent: u64, paused: bool) -> Vec<OutputStatus> {
    let link = |to: &str| LinkStatus {
        to: to.into(),
        keep: Keep::Latest,
        sent,
        dropped: 0,
        queued: 0,
        paused,
        transport: "unix".into(),
    };
    let links = vec![link("slam"), link("tool-echo-1"), link("slam:time")];
    vec![OutputStatus {
        id: "scan".into(),
        data: "laser.scan".into(),
        type_name: String::new(),
        published: sent,
        published_bytes: 0,
        links,
    }]
}

fn statuses(change: impl FnOnce(&mut Status)) -> BTreeMap<String, Status> {
    let input = InputStatus {
        id: "scan".into(),
        data: "laser.scan".into(),
        connected: true,
        received: 10,
        waiting: 0,
        lost: 0,
        dropped: 0,
        skipped: 0,
        history_dropped: 0,
        connections: 1,
        problem: String::new(),
    };
    let mut status = Status {
        name: "slam".into(),
        kind: "slam".into(),
        state: RunState::Active,
        activation: 1,
        controllable: true,
        uptime_s: 1.0,
        exec_calls: 5,
        skipped_ticks: 0,
        skipped_share: 0.0,
        clock_offset_s: 0.0,
        clock_error_s: None,
        last_error: String::new(),
        untaken_events: 0,
        time_s: 5.0,
        busy: false,
        call: None,
        outputs: Vec::new(),
        inputs: vec![input],
    };
    change(&mut status);
    BTreeMap::from([("slam".to_owned(), status)])
}

#[test]
fn what_was_published_is_taken_when_it_has_arrived_and_nothing_more_is_done() {
    let mut check = DeliveryCheck::default();
    let mut look = |sent, paused, change: fn(&mut Status)| {
        let pending = check.find_pending(&outputs(sent, paused), 5.0, &statuses(change));
        pending.map(|pending| pending.to_string()).unwrap_or_default()
    };
    assert_eq!(look(10, false, |_| {}), "the components work", "the first look shows no change");
    assert_eq!(look(10, false, |_| {}), "");
    assert_eq!(look(11, false, |_| {}), "slam has not taken laser.scan");
    assert_eq!(look(11, false, |it| it.inputs[0].waiting = 1), "slam has not taken laser.scan");
    let in_call = |it: &mut Status| {
        it.inputs[0].received = 11;
        it.busy = true;
    };
    assert_eq!(look(11, false, in_call), "slam is busy");
    assert_eq!(look(11, false, |it| it.inputs[0].received = 11), "the components work");
    assert_eq!(look(11, false, |it| it.inputs[0].received = 11), "");
    assert_eq!(look(12, false, |it| it.inputs[0].dropped = 2), "the components work");
    assert_eq!(look(12, false, |it| it.inputs[0].dropped = 2), "", "dropped is not on its way");
    // A frozen component takes nothing.
    assert_eq!(look(16, true, |it| it.state = RunState::Frozen), "", "nothing was done since");
}

#[test]
fn a_component_that_takes_too_long_is_excused_until_it_has_finished() {
    let mut check = DeliveryCheck::default();
    let mut look = |excused: bool, change: fn(&mut Status)| {
        if excused {
            check.excuse("slam");
        }
        let pending = check.find_pending(&outputs(1, false), 6.0, &statuses(change));
        pending.map(|pending| pending.to_string()).unwrap_or_default()
    };
    assert_eq!(look(false, |_| {}), "slam has an earlier time");
    assert_eq!(look(true, |_| {}), "the components work", "nothing else is pending");
    assert_eq!(look(false, |_| {}), "");
    assert_eq!(look(false, |it| it.time_s = 6.0), "", "it has finished");
    assert_eq!(look(false, |_| {}), "slam has an earlier time", "it is waited for again");
}

#[test]
fn components_that_never_rest_are_not_waited_for_without_end() {
    let mut check = DeliveryCheck::default();
    let looks = (0..100).position(|exec_calls| {
        check.find_pending(&[], 0.0, &statuses(|it| it.exec_calls = exec_calls)).is_none()
    });
    assert_eq!(looks, Some(20));
}
