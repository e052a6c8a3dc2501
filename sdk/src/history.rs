//! The last messages of an input, for components that need more than the newest: pairs by time,
//! interpolation, trends. How many is in the file (`history="n"` of the link).

use std::collections::VecDeque;

use armor_wire::frame::DataHeader;

use crate::data::{Data, Header};
use crate::declared::DeclaredType;
use crate::link::payload::{Payload, StoredPayload};

/// Longest history of an input, in bytes; beyond it the oldest messages are dropped and counted.
const MAX_LEN: usize = 64 << 20;

/// The stored messages of one input, oldest first.
#[derive(Debug, Default)]
pub(crate) struct HistoryStore {
    /// Most messages; at most one: none are stored.
    most: usize,
    messages: VecDeque<StoredMessage>,
    len: usize,
}

#[derive(Debug)]
struct StoredMessage {
    header: DataHeader,
    lost: u64,
    payload: StoredPayload,
}

impl HistoryStore {
    /// A store of the last `most` messages.
    pub fn new(most: u32) -> Self {
        Self { most: most as usize, ..Self::default() }
    }

    /// Whether messages are stored.
    pub fn is_kept(&self) -> bool {
        self.most > 1
    }

    /// Forgets all messages: they are those of another activation.
    pub fn clear(&mut self) {
        self.messages.clear();
        self.len = 0;
    }

    /// Adds a message. Returns how many older ones were dropped because all are too long together.
    pub fn push(&mut self, header: DataHeader, lost: u64, payload: Payload<'_>) -> u64 {
        self.push_within(header, lost, payload, MAX_LEN)
    }

    fn push_within(
        &mut self,
        header: DataHeader,
        lost: u64,
        payload: Payload<'_>,
        max_len: usize,
    ) -> u64 {
        let mut spare = StoredPayload::default();
        if self.messages.len() >= self.most {
            spare = self.pop_oldest();
        }
        let mut dropped = 0;
        while self.len + payload.bytes().len() > max_len && !self.messages.is_empty() {
            spare = self.pop_oldest();
            dropped += 1;
        }
        let payload = payload.store(spare);
        self.len += payload.len();
        self.messages.push_back(StoredMessage { header, lost, payload });
        dropped
    }

    /// Takes the oldest message; returns its memory.
    fn pop_oldest(&mut self) -> StoredPayload {
        let payload = self.messages.pop_front().map(|message| message.payload).unwrap_or_default();
        self.len -= payload.len();
        payload
    }
}

/// An input, as others see its history.
#[derive(Clone, Copy, Debug)]
pub(crate) struct HistoryOfInput<'a> {
    pub store: &'a HistoryStore,
    pub data: &'a str,
    pub declared: DeclaredType<'a>,
}

/// The last messages of an input since the component was activated, newest first. The message that
/// is being received is among them.
#[derive(Clone, Copy, Debug)]
pub struct History<'a>(pub(crate) HistoryOfInput<'a>);

/// A message of a [`History`].
#[derive(Clone, Copy, Debug)]
pub struct PastMessage<'a> {
    /// Its header. `lost` counts the messages that are missing before it.
    pub header: Header<'a>,
    /// Its content.
    pub data: Data<'a>,
    /// The message before it is of another process start of the publisher.
    pub restarted: bool,
}

impl PastMessage<'_> {
    /// Whether the message before it in the history is not the one that was published before it.
    pub fn follows_gap(&self) -> bool {
        self.header.lost > 0 || self.restarted
    }
}

impl<'a> History<'a> {
    /// How many messages there are.
    pub fn len(&self) -> usize {
        self.0.store.messages.len()
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.0.store.messages.is_empty()
    }

    /// The message of that age: 0 is the newest.
    pub fn get(&self, age: usize) -> Option<PastMessage<'a>> {
        let index = self.len().checked_sub(age + 1)?;
        let HistoryOfInput { store, data, declared } = self.0;
        let message = store.messages.get(index)?;
        let before = index.checked_sub(1).and_then(|before| store.messages.get(before));
        let DataHeader { sequence, stamp_s, instance, .. } = message.header;
        let lost = message.lost;
        Some(PastMessage {
            header: Header { id: declared.input, data, sequence, stamp_s, instance, lost },
            data: Data::alone(message.payload.as_payload(), declared),
            restarted: before.is_some_and(|before| before.header.instance != instance),
        })
    }

    /// All messages, newest first.
    pub fn iter(self) -> impl Iterator<Item = PastMessage<'a>> {
        (0..self.len()).filter_map(move |age| self.get(age))
    }

    /// The message whose stamp is nearest to a time in seconds; of several the newest.
    pub fn nearest(&self, stamp_s: f64) -> Option<PastMessage<'a>> {
        self.get(self.nearest_age(stamp_s)?)
    }

    /// The age of the message that [`nearest`](Self::nearest) returns.
    pub fn nearest_age(&self, stamp_s: f64) -> Option<usize> {
        let distance = |age: usize| (self.stamp(age) - stamp_s).abs();
        let ages = (0..self.len()).filter(|age| distance(*age).is_finite());
        ages.min_by(|a, b| distance(*a).total_cmp(&distance(*b)))
    }

    /// The two messages between which a time in seconds lies, the earlier one first, to interpolate:
    /// neighbours in the history, of the same process start of the publisher; of several pairs the
    /// newest. Both are the same message if its stamp is that time exactly. Messages may be
    /// missing between them ([`PastMessage::follows_gap`] of the later one).
    pub fn around(&self, stamp_s: f64) -> Option<(PastMessage<'a>, PastMessage<'a>)> {
        let (earlier, later) = self.ages_around(stamp_s)?;
        self.get(earlier).zip(self.get(later))
    }

    /// The ages of the messages that [`around`](Self::around) returns, that of the earlier one first.
    pub fn ages_around(&self, stamp_s: f64) -> Option<(usize, usize)> {
        for age in 0..self.len() {
            if self.stamp(age) == stamp_s {
                return Some((age, age));
            }
            let is_between = age + 1 < self.len()
                && self.stamp(age + 1) < stamp_s
                && stamp_s < self.stamp(age)
                && self.instance(age + 1) == self.instance(age);
            if is_between {
                return Some((age + 1, age));
            }
        }
        None
    }

    fn stamp(&self, age: usize) -> f64 {
        self.message(age).map_or(f64::NAN, |message| message.header.stamp_s)
    }

    fn instance(&self, age: usize) -> Option<u64> {
        self.message(age).map(|message| message.header.instance)
    }

    fn message(&self, age: usize) -> Option<&'a StoredMessage> {
        self.len().checked_sub(age + 1).and_then(|index| self.0.store.messages.get(index))
    }
}

#[cfg(test)]
mod tests {
    use armor_wire::codec;
    use armor_wire::message::Message;
    use proptest::prelude::*;

    use super::*;
    use crate::messages::Count;

    fn message(sequence: u64, stamp_s: f64, instance: u64) -> DataHeader {
        DataHeader { sequence, stamp_s, instance, fresh: false }
    }

    fn view(store: &HistoryStore) -> History<'_> {
        let (name, schema_hash) = (Count::NAME, Count::schema_hash());
        let declared = DeclaredType { input: "steps", name, schema_hash, learned: None };
        History(HistoryOfInput { store, data: "legs.steps", declared })
    }

    #[test]
    fn the_last_messages_are_read_newest_first() {
        let mut store = HistoryStore::new(3);
        assert!(view(&store).is_empty() && view(&store).get(0).is_none());
        for count in 0..5 {
            let bytes = codec::encode(&Count { count }).unwrap();
            let lost = if count == 3 { 7 } else { 0 };
            store.push(message(count, count as f64, 1 + count / 4), lost, Payload::Buffer(&bytes));
        }
        let history = view(&store);
        let counts: Vec<_> =
            history.iter().map(|it| it.data.decode::<Count>().unwrap().count).collect();
        assert_eq!((counts, history.len()), (vec![4, 3, 2], 3));
        let gaps: Vec<_> = history.iter().map(|it| (it.header.lost, it.restarted)).collect();
        assert_eq!(gaps, [(0, true), (7, false), (0, false)]);
        assert_eq!(history.get(0).unwrap().header.data(), "legs.steps");
        store.clear();
        assert!(view(&store).is_empty());
    }

    #[test]
    fn a_history_is_no_longer_than_its_memory_and_what_is_dropped_is_counted() {
        let mut store = HistoryStore::new(1000);
        let push = |store: &mut HistoryStore, sequence, len: usize| {
            store.push_within(message(sequence, 0.0, 1), 0, Payload::Buffer(&vec![0; len]), 100)
        };
        assert_eq!((push(&mut store, 0, 40), push(&mut store, 1, 40)), (0, 0));
        assert_eq!((push(&mut store, 2, 40), store.messages.len()), (1, 2));
        assert_eq!((push(&mut store, 3, 90), store.messages.len()), (2, 1));
        assert_eq!((push(&mut store, 4, 400), store.messages.len()), (1, 1), "the newest is kept");
    }

    /// A stream with gaps, restarts, stamps that repeat, run back, and are no numbers.
    fn stream() -> impl Strategy<Value = Vec<(f64, u64)>> {
        let step = prop_oneof![
            12 => (1u8..4).prop_map(|steps| (f64::from(steps) * 0.5, false)),
            2 => Just((0.0, false)),
            2 => (1u8..8).prop_map(|steps| (-f64::from(steps) * 0.5, false)),
            1 => (0u8..6).prop_map(|steps| (f64::from(steps) * 0.5, true)),
            1 => Just((f64::NAN, false)),
        ];
        proptest::collection::vec(step, 0..30).prop_map(|steps| {
            let (mut now, mut instance) = (0.0, 1);
            let mut stream = Vec::new();
            for (step, restarts) in steps {
                instance += u64::from(restarts);
                if step.is_finite() {
                    now += step;
                }
                stream.push((if step.is_nan() { step } else { now }, instance));
            }
            stream
        })
    }

    /// All candidates, written down without an order of search: the newest wins.
    fn search_around(kept: &[(f64, u64)], stamp_s: f64) -> Option<(usize, usize)> {
        let exact =
            kept.iter().enumerate().filter(|(_, it)| it.0 == stamp_s).map(|(at, _)| (at, at));
        let between = (1..kept.len()).filter(|at| {
            let (earlier, later) = (kept[at - 1], kept[*at]);
            earlier.1 == later.1 && earlier.0 < stamp_s && later.0 > stamp_s
        });
        exact.chain(between.map(|at| (at - 1, at))).max_by_key(|(_, later)| *later)
    }

    fn search_nearest(kept: &[(f64, u64)], stamp_s: f64) -> Option<usize> {
        let distance = |at: &usize| (kept[*at].0 - stamp_s).abs();
        let least = (0..kept.len()).map(|at| distance(&at)).filter(|it| !it.is_nan());
        let least = least.reduce(f64::min)?;
        (0..kept.len()).filter(|at| distance(at) == least).max()
    }

    /// `ARMOR_FULL=1`: a million streams.
    fn count_streams() -> u32 {
        if std::env::var_os("ARMOR_FULL").is_some() { 1_000_000 } else { 2_000 }
    }

    proptest! {
        #![proptest_config(ProptestConfig { cases: count_streams(), ..ProptestConfig::default() })]
        #[test]
        fn what_is_around_and_nearest_is_what_a_plain_search_finds(
            stream in stream(), most in 2u32..20, asked in -8i8..60,
        ) {
            let mut store = HistoryStore::new(most);
            for (sequence, (stamp_s, instance)) in stream.iter().enumerate() {
                store.push(message(sequence as u64, *stamp_s, *instance), 0, Payload::Buffer(&[]));
            }
            let kept = &stream[stream.len().saturating_sub(most as usize)..];
            let first = stream.len() - kept.len();
            let place = |it: PastMessage<'_>| it.header.sequence as usize - first;
            let stamp_s = f64::from(asked) * 0.25;
            let found = view(&store).around(stamp_s).map(|(a, b)| (place(a), place(b)));
            prop_assert_eq!(found, search_around(kept, stamp_s));
            let found = view(&store).nearest(stamp_s).map(place);
            prop_assert_eq!(found, search_nearest(kept, stamp_s));
        }
    }
}
