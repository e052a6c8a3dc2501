use std::collections::BTreeMap;
use std::sync::Arc;
use std::time::Duration;

use proptest::prelude::*;

use super::packet::{DataPacket, Fragment, Receipt};
use super::*;
use crate::frame::DataHeader;

const MS: Duration = Duration::from_millis(1);
/// Between two receipts of a subscriber that gets nothing.
const RECEIPT_PERIOD: Duration = Duration::from_millis(400);

/// Both ends of a link, and the network between them, in steps of a millisecond.
struct Simulation {
    random: fastrand::Rng,
    now: Duration,
    sender: DatagramSender,
    receiver: DatagramReceiver,
    /// The share of datagrams that are lost, in each direction.
    loss: f64,
    delay: Duration,
    /// Up to so much longer.
    jitter: Duration,
    /// By time of arrival.
    to_subscriber: BTreeMap<(Duration, u64), Vec<u8>>,
    to_publisher: BTreeMap<(Duration, u64), Vec<u8>>,
    stream: BTreeMap<(Duration, u64), InStream>,
    count: u64,
    last_receipt: Duration,
    /// Sequence and age of what was delivered.
    delivered: Vec<(u64, Duration)>,
    published_at: Vec<Duration>,
    switches: Vec<bool>,
}

enum InStream {
    Switch(DatagramSwitchBody),
    Data(ReceivedMessage),
}

impl Simulation {
    fn new(seed: u64, resent: u32) -> Self {
        Self {
            random: fastrand::Rng::with_seed(seed),
            now: Duration::ZERO,
            sender: DatagramSender::new(7, resent, Duration::ZERO),
            receiver: DatagramReceiver::new(7, resent),
            loss: 0.0,
            delay: 20 * MS,
            jitter: Duration::ZERO,
            to_subscriber: BTreeMap::new(),
            to_publisher: BTreeMap::new(),
            stream: BTreeMap::new(),
            count: 0,
            last_receipt: Duration::ZERO,
            delivered: Vec::new(),
            published_at: Vec::new(),
            switches: Vec::new(),
        }
    }

    fn arrival(&mut self) -> (Duration, u64) {
        self.count += 1;
        let jitter = self.jitter.mul_f64(self.random.f64());
        (self.now + self.delay + jitter, self.count)
    }

    fn send_datagrams(&mut self, datagrams: Vec<Vec<u8>>) {
        for datagram in datagrams {
            assert!(datagram.len() <= DATAGRAM_LEN);
            if self.random.f64() >= self.loss {
                let at = self.arrival();
                self.to_subscriber.insert(at, datagram);
            }
        }
    }

    fn send_by_stream(&mut self, what: InStream) {
        self.count += 1;
        self.stream.insert((self.now + self.delay, self.count), what);
    }

    fn publish(&mut self, payload: &[u8]) {
        let sequence = self.published_at.len() as u64;
        self.published_at.push(self.now);
        let header = DataHeader { sequence, stamp_s: 0.5, instance: 1, fresh: false };
        if self.sender.is_on() {
            let mut sent = Vec::new();
            self.sender.publish(&header, &Arc::from(payload), self.now, |it| sent.push(it.into()));
            self.send_datagrams(sent);
        } else {
            self.send_by_stream(InStream::Data(message(&header, payload)));
        }
    }

    fn step(&mut self) {
        self.now += MS;
        while let Some(first) = self.to_publisher.first_entry().filter(|it| it.key().0 <= self.now)
        {
            let datagram = first.remove();
            let mut sent = Vec::new();
            let effect = self.sender.receive(&datagram, self.now, |it| sent.push(it.into()));
            self.send_datagrams(sent);
            if effect == ReceiptEffect::SwitchOn {
                self.switches.push(true);
                let next = self.published_at.len() as u64;
                let switch = DatagramSwitchBody { in_datagrams: true, next };
                self.send_by_stream(InStream::Switch(switch));
            }
        }
        let mut sent = Vec::new();
        self.sender.resend(self.now, |it| sent.push(it.into()));
        self.send_datagrams(sent);
        if self.sender.note_silence(self.now) {
            self.switches.push(false);
            let next = self.sender.floor();
            let switch = DatagramSwitchBody { in_datagrams: false, next };
            self.send_by_stream(InStream::Switch(switch));
            for (header, payload) in self.sender.switch_off() {
                self.send_by_stream(InStream::Data(message(&header, &payload)));
            }
        }
        self.step_subscriber();
    }

    fn step_subscriber(&mut self) {
        let mut has_come = false;
        while let Some(first) = self.stream.first_entry().filter(|it| it.key().0 <= self.now) {
            match first.remove() {
                InStream::Switch(switch) => self.receiver.switch(switch),
                InStream::Data(message) => self.receiver.receive_by_stream(message),
            }
            self.take_messages();
        }
        while let Some(first) = self.to_subscriber.first_entry().filter(|it| it.key().0 <= self.now)
        {
            has_come |= self.receiver.receive(&first.remove());
            self.take_messages();
        }
        let is_due = self.now - self.last_receipt >= RECEIPT_PERIOD;
        if is_due || has_come {
            self.last_receipt = self.now;
            let receipt = self.receiver.write_receipt();
            if self.random.f64() >= self.loss {
                let at = self.arrival();
                self.to_publisher.insert(at, receipt);
            }
        }
    }

    fn take_messages(&mut self) {
        while let Some(message) = self.receiver.take_message() {
            let sequence = message.sequence;
            let payload = payload(sequence, message.payload.len());
            assert!(message.payload == payload, "{sequence}: the bytes are those that were sent");
            let age = self.now - self.published_at[sequence as usize];
            self.delivered.push((sequence, age));
        }
    }

    /// Publishes `count` messages of `len` bytes, one each `period`, and runs until all have come that
    /// will.
    fn run(&mut self, count: u64, len: usize, period: Duration) {
        let first = self.published_at.len() as u64;
        for sequence in first..first + count {
            self.publish(&payload(sequence, len));
            let end = self.now + period;
            while self.now < end {
                self.step();
            }
        }
        for _ in 0..3000 {
            self.step();
        }
        assert!(self.delivered.is_sorted_by(|a, b| a.0 < b.0), "in order, each once");
    }

    fn age_at(&self, share: f64) -> Duration {
        let mut ages: Vec<_> = self.delivered.iter().map(|(_, age)| *age).collect();
        ages.sort();
        ages[((ages.len() - 1) as f64 * share) as usize]
    }
}

fn message(header: &DataHeader, payload: &[u8]) -> ReceivedMessage {
    let DataHeader { sequence, stamp_s, fresh, .. } = *header;
    ReceivedMessage { sequence, stamp_s, fresh, payload: payload.to_vec() }
}

fn payload(sequence: u64, len: usize) -> Vec<u8> {
    (0..len).map(|at| (at as u64 ^ sequence.wrapping_mul(0x9E37) >> 3) as u8).collect()
}

#[test]
fn without_losses_all_messages_come_and_none_is_sent_twice() {
    for resent in [0, 1, 3, 64] {
        for len in [0, 1, 1152, 1153, 10_000, MAX_DATAGRAM_MESSAGE] {
            let mut link = Simulation::new(1, resent);
            link.run(60, len, 50 * MS);
            let sequences: Vec<u64> = link.delivered.iter().map(|(at, _)| *at).collect();
            assert_eq!(sequences, Vec::from_iter(0..60), "{resent} {len}");
            assert_eq!(link.switches, [true]);
        }
    }
}

#[test]
fn at_a_loss_of_a_third_some_are_sent_again_in_time() {
    let mut shares = Vec::new();
    for resent in [0, 3] {
        let mut link = Simulation::new(2, resent);
        link.loss = 0.3;
        link.run(20_000, 100, 50 * MS);
        shares.push(link.delivered.len() as f64 / 20_000.0);
    }
    let [none, some] = shares[..] else { unreachable!("two") };
    assert!((0.68..0.73).contains(&none) && some >= 0.99, "{none} {some}");
}

#[test]
fn at_few_losses_the_newest_is_seldom_old() {
    let mut link = Simulation::new(3, 0);
    link.loss = 0.05;
    link.run(10_000, 100, 50 * MS);
    assert!(link.age_at(0.99) <= 25 * MS, "{:?}", link.age_at(0.99));
    let mut link = Simulation::new(3, 3);
    link.loss = 0.05;
    link.run(10_000, 100, 50 * MS);
    assert!(link.age_at(0.99) <= 125 * MS, "{:?}", link.age_at(0.99));
    assert!(link.delivered.len() >= 9_999, "{}", link.delivered.len());
}

#[test]
fn of_a_large_message_only_what_is_missing_is_sent_again() {
    let mut link = Simulation::new(4, 2);
    link.run(10, 100, 50 * MS);
    link.loss = 0.05;
    link.run(200, 100_000, 500 * MS);
    assert_eq!(link.delivered.len(), 210, "87 fragments each");
}

#[test]
fn where_datagrams_stop_the_stream_takes_over_and_they_come_back() {
    for resent in [0, 3] {
        let mut link = Simulation::new(5, resent);
        link.run(20, 100, 50 * MS);
        link.loss = 1.0;
        link.run(200, 100, 50 * MS);
        assert_eq!(link.switches, [true, false], "{resent}");
        link.loss = 0.0;
        link.run(100, 100, 50 * MS);
        assert_eq!(link.switches, [true, false, true], "{resent}");
        let missing = 320 - link.delivered.len();
        // Those of two seconds and the time to notice; all but the newest of them where some are sent
        // again.
        assert!((30..60).contains(&missing), "{resent}: {missing}");
    }
}

#[test]
fn datagrams_in_one_direction_are_not_enough() {
    let mut link = Simulation::new(6, 3);
    for _ in 0..10_000 {
        link.to_subscriber.clear();
        link.step();
    }
    assert!(link.switches.is_empty());
}

#[test]
fn a_link_that_carries_nothing_stays_as_it_is() {
    for resent in [0, 1, 3, 64] {
        let mut link = Simulation::new(7, resent);
        for published in 0..2 {
            let before = link.count;
            for _ in 0..60_000 {
                link.step();
            }
            assert_eq!(link.switches, [true]);
            // A receipt and a probe each 0.4 s, and those of the beginning.
            let count = link.count - before;
            assert!(count < 320, "{resent}, {published} published: {count}");
            link.publish(&payload(published, 1));
        }
    }
}

#[test]
fn where_no_large_message_becomes_whole_they_take_the_stream() {
    let mut link = Simulation::new(8, 0);
    link.run(20, 100, 50 * MS);
    link.loss = 0.2;
    // 87 fragments each.
    link.run(400, 100_000, 100 * MS);
    assert_eq!(link.switches[..2], [true, false]);
    let arrived = link.delivered.iter().filter(|(sequence, _)| *sequence >= 20).count();
    assert!(arrived > 200, "{arrived}");
}

#[test]
fn datagrams_that_arrive_only_now_and_then_are_left_for_longer_and_longer() {
    let mut link = Simulation::new(9, 0);
    for _ in 0..40 {
        link.loss = 0.0;
        link.run(12, 100, 50 * MS);
        link.loss = 1.0;
        for _ in 0..52 {
            link.publish(&payload(link.published_at.len() as u64, 100));
            (0..50).for_each(|_| link.step());
        }
    }
    let falls = link.switches.iter().filter(|is_on| !**is_on).count();
    assert!(falls <= 6, "{falls} in {:?}", link.now);
}

proptest! {
    #[test]
    fn in_every_network_messages_come_in_order_and_whole(
        seed: u64,
        resent in 0u32..8,
        loss in 0.0..0.6,
        jitter in 0u64..80,
        len in 0usize..5000,
        period in 1u64..80,
    ) {
        let mut link = Simulation::new(seed, resent);
        (link.loss, link.jitter) = (loss, MS * jitter as u32);
        link.run(60, len, MS * period as u32);
        if loss == 0.0 && resent > 0 {
            prop_assert_eq!(link.delivered.len(), 60);
        }
    }

    #[test]
    fn any_bytes_are_read_or_refused(bytes in proptest::collection::vec(any::<u8>(), 0..1300)) {
        let mut receiver = DatagramReceiver::new(0, 3);
        receiver.receive(&bytes);
        receiver.take_message();
        let mut sender = DatagramSender::new(0, 3, Duration::ZERO);
        sender.receive(&bytes, Duration::ZERO, |_| {});
        let mut buffer = [0; DATAGRAM_LEN];
        if let Some(packet) = DataPacket::read(&bytes) {
            let len = packet.write(&mut buffer);
            // A NaN keeps its bits.
            prop_assert_eq!(&buffer[..len], &bytes[..]);
        }
        if let Some(receipt) = Receipt::read(&bytes) {
            prop_assert_eq!(receipt.to_bytes(), bytes);
        }
    }
}

#[test]
fn what_is_written_is_read() {
    let mut buffer = [0; DATAGRAM_LEN];
    let fragment = Fragment {
        sequence: 5,
        stamp_s: 1.5,
        fresh: true,
        payload_len: 1155,
        index: 1,
        bytes: &[1, 2, 3],
    };
    for fragment in [None, Some(fragment)] {
        let packet = DataPacket { token: 1, number: 2, floor: 3, fragment };
        let len = packet.write(&mut buffer);
        assert_eq!(DataPacket::read(&buffer[..len]), Some(packet));
        assert_eq!(DataPacket::read(&buffer[..len - 1]), None);
        assert_eq!(Receipt::read(&buffer[..len]), None);
    }
}
