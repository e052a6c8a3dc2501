//! One thread that reads all outputs. It is woken for each message while there are few of them. While
//! there are many it looks every few milliseconds instead: a thread that is woken for each message
//! costs more than the rest of recording it.

use std::collections::{BTreeMap, BTreeSet, HashMap};
use std::io;
use std::os::fd::OwnedFd;
use std::sync::Arc;
use std::time::{Duration, Instant};

use armor_sdk::tap::{Tap, TapError, TapMessage};
use parking_lot::Mutex;
use rustix::event::{EventfdFlags, Timespec, epoll, eventfd};

use super::message_queue::{MessageQueue, TappedMessage};
use crate::head::MessageHead;
use crate::writer::OutputType;

/// Time between two looks while there are many messages. An output whose messages come by shared
/// memory has room for 32.
const LOOK_EVERY: Duration = Duration::from_millis(5);
/// Longest time asleep, after which beats are sent and the end is noticed.
const ASLEEP: Duration = Duration::from_millis(100);
/// Many messages are at least so many in [`ASLEEP`].
const MANY_MESSAGES: usize = 50;
/// Most bytes that one look brings, to keep the limit of the queue.
const LOOK_LEN: usize = 16 << 20;
/// Most reads of one socket in one look.
const MAX_READS: usize = 64;
/// The key of the inbox among the sockets that are waited for.
const INBOX: u64 = 0;

/// An output that is linked.
pub(super) struct OpenTap {
    pub data: String,
    pub output_type: Arc<OutputType>,
    pub tap: Tap,
}

/// Takes outputs for the thread that reads them. Clones are the same.
#[derive(Clone)]
pub(super) struct CollectorInbox(Arc<InboxState>);

struct InboxState {
    opened: Mutex<Vec<OpenTap>>,
    reports: Mutex<Vec<TappedMessage>>,
    /// Wakes the thread.
    bell: OwnedFd,
}

impl CollectorInbox {
    /// Starts a thread that reads outputs into `queue` until that takes no more.
    ///
    /// # Errors
    /// If the system has no thread or file descriptor for it.
    pub fn start(queue: Arc<MessageQueue>) -> io::Result<Self> {
        let bell = eventfd(0, EventfdFlags::CLOEXEC | EventfdFlags::NONBLOCK)?;
        let inbox = Self(Arc::new(InboxState {
            opened: Mutex::default(),
            reports: Mutex::default(),
            bell,
        }));
        let epoll = epoll::create(epoll::CreateFlags::CLOEXEC)?;
        epoll::add(&epoll, &inbox.0.bell, epoll::EventData::new_u64(INBOX), epoll::EventFlags::IN)?;
        let collector = TapCollector {
            queue,
            inbox: inbox.clone(),
            epoll,
            taps: BTreeMap::new(),
            ready: BTreeSet::new(),
            added: INBOX,
            first: INBOX,
            load: MessageLoad::new(Instant::now()),
        };
        let run = move || collector.run();
        std::thread::Builder::new().name("record-read".into()).spawn(run)?;
        Ok(inbox)
    }

    /// Has an output read from now on.
    pub fn add(&self, opened: OpenTap) {
        self.0.opened.lock().push(opened);
        self.ring();
    }

    /// Adds the report of a component, which comes after what was published before it.
    pub fn add_report(&self, report: TappedMessage) {
        self.0.reports.lock().push(report);
        self.ring();
    }

    /// Takes the reports that no look has taken.
    pub fn take_reports(&self) -> Vec<TappedMessage> {
        std::mem::take(&mut self.0.reports.lock())
    }

    fn take_opened(&self) -> Vec<OpenTap> {
        std::mem::take(&mut self.0.opened.lock())
    }

    fn ring(&self) {
        // It fails only if it has been rung very often and not been heard yet.
        let _ = rustix::io::write(&self.0.bell, &1_u64.to_ne_bytes());
    }

    fn silence(&self) {
        let _ = rustix::io::read(&self.0.bell, &mut [0; 8]);
    }
}

struct TapCollector {
    queue: Arc<MessageQueue>,
    inbox: CollectorInbox,
    epoll: OwnedFd,
    taps: BTreeMap<u64, OpenTap>,
    /// Those with bytes in their socket.
    ready: BTreeSet<u64>,
    /// The last key of a tap.
    added: u64,
    /// The key with which the next look begins: behind the one at which the last look had to end.
    first: u64,
    load: MessageLoad,
}

impl TapCollector {
    fn run(mut self) {
        let mut kept_alive = Instant::now();
        while !self.queue.is_ended() {
            let now = Instant::now();
            if self.ready.remove(&INBOX) {
                self.inbox.silence();
                self.adopt_opened();
            }
            if now.duration_since(kept_alive) >= ASLEEP {
                kept_alive = now;
                self.keep_alive(now);
            }
            let has_room = self.queue.has_room();
            let mut is_all = true;
            if has_room {
                let collected;
                (collected, is_all) = self.collect();
                self.load.add(collected.len(), now);
                self.queue.push_all(collected);
            }
            let may_sleep = has_room && is_all && !self.load.is_heavy();
            // Where a look did not bring all, the next one is due already.
            let pause = if has_room && !is_all { Duration::ZERO } else { LOOK_EVERY };
            self.wait(may_sleep, pause.saturating_sub(now.elapsed()));
        }
    }

    fn adopt_opened(&mut self) {
        for opened in self.inbox.take_opened() {
            self.added += 1;
            let key = epoll::EventData::new_u64(self.added);
            match epoll::add(&self.epoll, &opened.tap, key, epoll::EventFlags::IN) {
                Ok(()) => {
                    // Some may have come with the answer of the publisher.
                    self.taps.insert(self.added, opened);
                }
                Err(_) => self.queue.add_ended(opened.data),
            }
        }
    }

    /// Sends beats, and finds publishers that are silent.
    fn keep_alive(&mut self, now: Instant) {
        for (key, opened) in &mut self.taps {
            if opened.tap.keep_alive(now).is_err() || opened.tap.is_silent(now) {
                // Reading shows what is wrong.
                self.ready.insert(*key);
            }
        }
    }

    /// Reads what has arrived. Returns whether that is all.
    fn collect(&mut self) -> (Vec<TappedMessage>, bool) {
        let (mut collected, mut ended) = (Vec::new(), Vec::new());
        let mut left = LOOK_LEN;
        // Taken before the outputs are read, and added behind what is found there.
        let reports = self.inbox.take_reports();
        let (before, after) = (self.taps.range(..self.first), self.taps.range(self.first..));
        let keys: Vec<u64> = after.chain(before).map(|(key, _)| *key).collect();
        for key in keys {
            let Some(opened) = self.taps.get_mut(&key) else { continue };
            if let Err(error) = opened.read(self.ready.contains(&key), &mut left, &mut collected) {
                tracing::debug!("{} is not read any more: {error}", opened.data);
                ended.push(key);
            }
            if left == 0 {
                // An output that has always more must not keep the others from their turn.
                self.first = key + 1;
                break;
            }
        }
        for opened in ended.iter().filter_map(|key| self.taps.remove(key)) {
            // The next listing decides whether there is a provider again.
            self.queue.add_ended(opened.data);
        }
        let mut collected = order_by_stamp(collected);
        collected.extend(reports);
        (collected, left > 0)
    }

    /// Waits until something may have arrived.
    fn wait(&mut self, may_sleep: bool, pause: Duration) {
        let mut limit = Duration::ZERO;
        if !may_sleep {
            std::thread::sleep(pause);
        } else if self.taps.values().all(|opened| opened.tap.announce_sleep()) {
            limit = ASLEEP;
        }
        let limit = Timespec { tv_sec: 0, tv_nsec: i64::from(limit.subsec_nanos()) };
        let none = epoll::Event {
            flags: epoll::EventFlags::empty(),
            data: epoll::EventData::new_u64(INBOX),
        };
        let mut events = [none; 64];
        self.ready.clear();
        // It is only interrupted: then the next look finds what there is.
        let count = epoll::wait(&self.epoll, &mut events, Some(&limit)).unwrap_or(0);
        self.ready.extend(events[..count].iter().map(|event| event.data.u64()));
    }
}

impl OpenTap {
    /// Reads what has arrived in memory and, if `is_ready`, at the socket; about `left` bytes at most,
    /// of which it takes off what it has read.
    fn read(
        &mut self,
        is_ready: bool,
        left: &mut usize,
        collected: &mut Vec<TappedMessage>,
    ) -> Result<(), TapError> {
        for _ in 0..MAX_READS {
            while *left > 0
                && let Some(message) = self.tap.take_arrived()?
            {
                *left = left.saturating_sub(message.payload.len());
                collected.push(self.tapped(message));
            }
            if *left == 0 || !is_ready {
                return Ok(());
            }
            match self.tap.receive_now() {
                Ok(true) => {}
                Ok(false) => break,
                Err(error) => {
                    // What the publisher has put into memory before its end.
                    while let Ok(Some(message)) = self.tap.take_arrived() {
                        collected.push(self.tapped(message));
                    }
                    return Err(error);
                }
            }
        }
        self.read(false, left, collected)
    }

    fn tapped(&self, TapMessage { header, payload, lost }: TapMessage) -> TappedMessage {
        let head = MessageHead {
            sequence: header.sequence,
            stamp_s: header.stamp_s,
            instance: header.instance,
            lost,
        };
        let (data, output_type) = (self.data.clone(), Arc::clone(&self.output_type));
        TappedMessage { data, output_type, head, payload }
    }
}

/// Measures how many messages there are.
struct MessageLoad {
    since: Instant,
    count: usize,
    was_heavy: bool,
}

impl MessageLoad {
    fn new(now: Instant) -> Self {
        Self { since: now, count: 0, was_heavy: false }
    }

    fn add(&mut self, count: usize, now: Instant) {
        if now.duration_since(self.since) >= ASLEEP {
            self.was_heavy = self.count >= MANY_MESSAGES;
            (self.since, self.count) = (now, 0);
        }
        self.count += count;
    }

    fn is_heavy(&self) -> bool {
        self.was_heavy || self.count >= MANY_MESSAGES
    }
}

/// Puts the messages of one look into the order of their stamps, in which those of one output stay in
/// theirs.
fn order_by_stamp(messages: Vec<TappedMessage>) -> Vec<TappedMessage> {
    let mut last: HashMap<String, f64> = HashMap::new();
    let mut ordered: Vec<(f64, TappedMessage)> = Vec::with_capacity(messages.len());
    for message in messages {
        let mut at_s = message.head.stamp_s;
        match last.get_mut(&message.data) {
            Some(last_s) => {
                at_s = at_s.max(*last_s);
                *last_s = at_s;
            }
            None => {
                last.insert(message.data.clone(), at_s);
            }
        }
        ordered.push((at_s, message));
    }
    // Stable, so that equal stamps change nothing.
    ordered.sort_by(|(a_s, _), (b_s, _)| a_s.total_cmp(b_s));
    ordered.into_iter().map(|(_, message)| message).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn messages_of_one_look_are_ordered_by_stamp_and_those_of_an_output_stay_in_order() {
        let messages = [("a.x", 1, 5.0), ("a.x", 2, 7.0), ("a.x", 3, 6.5), ("b.y", 1, 4.0)]
            .into_iter()
            .chain([("b.y", 2, 6.0), ("b.y", 3, 7.0), ("c.z", 1, f64::NAN)])
            .map(|(data, sequence, stamp_s)| TappedMessage {
                data: data.into(),
                output_type: Arc::default(),
                head: MessageHead { sequence, stamp_s, ..MessageHead::default() },
                payload: Vec::new().into(),
            });
        let ordered = order_by_stamp(messages.collect());
        let ordered: Vec<_> = ordered.iter().map(|it| (&*it.data, it.head.sequence)).collect();
        let expected = [("b.y", 1), ("a.x", 1), ("b.y", 2), ("a.x", 2), ("a.x", 3), ("b.y", 3)];
        assert_eq!(ordered[..6], expected);
        assert_eq!(ordered[6], ("c.z", 1));
    }

    #[test]
    fn a_load_is_heavy_while_there_are_many_messages() {
        let start = Instant::now();
        let mut load = MessageLoad::new(start);
        load.add(MANY_MESSAGES - 1, start);
        assert!(!load.is_heavy());
        load.add(1, start);
        assert!(load.is_heavy());
        load.add(1, start + ASLEEP);
        assert!(load.is_heavy(), "the time before counts");
        load.add(0, start + ASLEEP * 2);
        assert!(!load.is_heavy());
    }
}
