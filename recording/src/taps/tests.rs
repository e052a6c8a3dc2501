//! Tests of the taps with a registry and a publisher in this process.

use std::sync::mpsc;

use armor_inspect::ObservedSystem;
use armor_registry::{RegistryOptions, serve};
use armor_sdk::messages::{CompressedImage, FrameTransforms, Image, LaserScan, Number};
use armor_sdk::node::{NodeOptions, SystemNode};
use armor_wire::message::WireType;

use super::*;

/// Only a hang takes this long.
const DEADLINE: Duration = Duration::from_secs(20);
const IMAGE_LEN: usize = 100_000;

#[test]
fn outputs_with_lists_of_numbers_come_by_shared_memory() {
    let bulk = [Image::schema(), CompressedImage::schema(), LaserScan::schema()];
    assert!(bulk.iter().all(has_bulk));
    let others = [Number::schema(), FrameTransforms::schema()];
    assert!(!others.iter().any(has_bulk));
}

struct Publisher {
    node: SystemNode,
    directory: Directory,
    taps: OutputTaps,
    published: u64,
}

impl Publisher {
    fn start() -> Self {
        let (sender, address) = mpsc::channel();
        std::thread::spawn(move || {
            let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build();
            let options =
                RegistryOptions { listen: ([127, 0, 0, 1], 0).into(), ..Default::default() };
            let ready = move |address| sender.send(address).unwrap_or_default();
            runtime.map(|runtime| runtime.block_on(serve(options, ready)).map(drop))
        });
        let registry = address.recv_timeout(DEADLINE).unwrap().to_string();
        let options = NodeOptions {
            name: "camera".into(),
            kind: "camera".into(),
            registry: registry.clone(),
        };
        let node = SystemNode::start(&options, DEADLINE, |armor| {
            armor.provide::<CompressedImage>("image")?;
            armor.provide::<Number>("number")?;
            Ok(())
        });
        let directory = ObservedSystem::at(&registry, "test").directory().clone();
        let mut taps =
            OutputTaps::new(directory.clone(), OutputSelection::default(), None).unwrap();
        assert_eq!(taps.follow_outputs().unwrap().len(), 2);
        let mut publisher = Self { node: node.unwrap(), directory, taps, published: 0 };
        // From here on both are linked.
        let mut seen = BTreeSet::new();
        let start = Instant::now();
        while seen.len() < 2 {
            assert!(start.elapsed() < DEADLINE, "the outputs are not read");
            publisher.publish();
            seen.extend(publisher.taps.next_message(Duration::from_millis(5)).map(|it| it.data));
        }
        publisher
    }

    /// Publishes an image with its number in each of its bytes, and the number.
    fn publish(&mut self) {
        self.published += 1;
        let data = vec![self.published as u8; IMAGE_LEN].into();
        let image = CompressedImage { format: "x".into(), data, ..Default::default() };
        self.node.armor().send_data("image", &image).unwrap();
        let number = Number { data: self.published as f64 };
        self.node.armor().send_data("number", &number).unwrap();
    }

    /// Takes messages until the last that was published has come of both outputs.
    fn take_rest(&mut self) -> BTreeMap<String, Vec<TappedMessage>> {
        let mut taken: BTreeMap<String, Vec<TappedMessage>> = BTreeMap::new();
        let start = Instant::now();
        let is_last = |messages: &Vec<TappedMessage>| {
            messages.last().is_some_and(|it| it.head.sequence + 1 == self.published)
        };
        while taken.values().filter(|messages| is_last(messages)).count() < 2 {
            assert!(start.elapsed() < DEADLINE, "the last messages do not come");
            let message = self.taps.next_message(Duration::from_millis(100));
            message.into_iter().for_each(|it| taken.entry(it.data.clone()).or_default().push(it));
        }
        taken
    }
}

/// Checks that each message has come or is counted, and that no image was written over.
fn check(taken: &BTreeMap<String, Vec<TappedMessage>>) {
    for messages in taken.values() {
        for pair in messages.windows(2) {
            let [before, message] = [&pair[0].head, &pair[1].head];
            assert_eq!(message.sequence, before.sequence + 1 + message.lost);
        }
    }
    for message in &taken["camera.image"] {
        let image = codec::decode::<CompressedImage>(&message.payload).unwrap();
        let number = (message.head.sequence + 1) as u8;
        assert!(image.data.iter().all(|byte| *byte == number), "image {number}");
    }
}

#[test]
fn large_messages_are_read_where_their_publisher_has_written_them() {
    let mut publisher = Publisher::start();
    let mut shared = 0;
    for _ in 0..10 {
        publisher.publish();
        let taken = publisher.take_rest();
        check(&taken);
        shared += taken["camera.image"].iter().filter(|it| it.payload.is_shared()).count();
        assert!(taken["camera.number"].iter().all(|it| !it.payload.is_shared()));
    }
    assert!(shared >= 8, "only {shared} in shared memory");
}

#[test]
fn a_writer_that_stands_still_is_waited_for_and_holds_few_slots() {
    let mut publisher = Publisher::start();
    let start = publisher.published;
    for _ in 0..200 {
        publisher.publish();
        std::thread::sleep(Duration::from_millis(2));
    }
    let taken = publisher.take_rest();
    check(&taken);
    let shared = taken["camera.image"].iter().filter(|it| it.payload.is_shared()).count();
    assert!(shared <= 8, "{shared} slots are held");
    let count = taken["camera.number"].iter().filter(|it| it.head.sequence >= start).count();
    assert_eq!(count, 200, "small messages wait at the publisher");
}

#[test]
fn a_tool_that_waits_is_woken_for_a_message_in_memory() {
    let mut publisher = Publisher::start();
    let open = |is_in_memory: bool| {
        let open = if is_in_memory { Tap::open_in_memory } else { Tap::open };
        open(&publisher.directory, "camera.image", KEEP_IN_MEMORY, PROVIDER_WITHIN).unwrap()
    };
    let readers = [open(true), open(false)].map(|mut tap| {
        let (sender, received) = mpsc::channel();
        std::thread::spawn(move || {
            while let Ok(message) = tap.next(DEADLINE) {
                let _ = sender.send(message);
            }
        });
        received
    });
    for round in 0..5 {
        publisher.publish();
        let expected = publisher.published;
        for received in &readers {
            let message = received.recv_timeout(DEADLINE).unwrap().expect("it is woken");
            assert_eq!(message.header.sequence + 1, expected, "round {round}");
            let image = codec::decode::<CompressedImage>(&message.payload).unwrap();
            assert!(image.data.iter().all(|byte| *byte == expected as u8));
        }
    }
}
