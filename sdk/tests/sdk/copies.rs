//! How many times a message is copied on its way through shared memory, by count: a process that
//! allocates fewer bytes in its life than a message has cannot have copied one.

use armor_sdk::prelude::*;
use cap::Cap;

use crate::bench_system::System;
use crate::role_process::RoleProcess;

/// Counts the bytes that this process allocates.
#[global_allocator]
static ALLOCATED: Cap<std::alloc::System> = Cap::new(std::alloc::System, usize::MAX);

/// Bytes of a message: more than a process allocates for everything else.
const LEN: usize = 8 << 20;
/// The bytes that are looked at: one of each page of memory.
const PAGE: usize = 4096;
/// Messages that each subscriber gets at least.
const MESSAGES: u64 = 50;

/// A large message.
#[derive(Clone, Debug, PartialEq, Message)]
#[message(view)]
struct LargeBlob {
    count: u64,
    bytes: Array<u8>,
}

/// Prints what has happened so often, and the bytes that were allocated until now.
fn print_allocated(count: u64) {
    println!("allocated {count} {}", ALLOCATED.total_allocated());
}

/// Publishes one message again and again.
pub struct LargePublisher {
    armor: Armor,
    message: LargeBlob,
}

impl Component for LargePublisher {
    const KIND: &'static str = "large-publisher";
    const SUMMARY: &'static str = "Publishes one large message again and again.";

    fn new(armor: Armor) -> Result<Self, Fault> {
        armor.provide::<LargeBlob>("data")?;
        Ok(Self { armor, message: LargeBlob { count: 0, bytes: vec![7; LEN].into() } })
    }

    fn exec(&mut self, _: Call) -> Result<Outcome, Fault> {
        self.message.count += 1;
        self.armor.send_data("data", &self.message)?;
        print_allocated(self.message.count);
        Ok(Outcome::CarryOn)
    }
}

/// Reads each message where it is.
pub struct ViewingReader {
    received: u64,
}

impl Component for ViewingReader {
    const KIND: &'static str = "viewing-reader";
    const SUMMARY: &'static str = "Reads messages where they are.";

    fn new(armor: Armor) -> Result<Self, Fault> {
        armor.subscribe::<LargeBlob>("data")?;
        Ok(Self { received: 0 })
    }

    fn data_received(&mut self, _: &Header<'_>, data: &Data<'_>) -> Result<(), Fault> {
        let bytes = data.view::<LargeBlob>()?.bytes;
        if bytes.len() != LEN || (0..LEN).step_by(PAGE).any(|at| bytes.get(at) != Some(7)) {
            return Err("it is another message".into());
        }
        self.received += 1;
        print_allocated(self.received);
        Ok(())
    }
}

/// Copies each message into a value of its own.
pub struct DecodingReader {
    received: u64,
}

impl Component for DecodingReader {
    const KIND: &'static str = "decoding-reader";
    const SUMMARY: &'static str = "Copies messages.";

    fn new(armor: Armor) -> Result<Self, Fault> {
        armor.subscribe::<LargeBlob>("data")?;
        Ok(Self { received: 0 })
    }

    fn data_received(&mut self, _: &Header<'_>, data: &Data<'_>) -> Result<(), Fault> {
        let message: LargeBlob = data.decode()?;
        self.received += u64::from(message.bytes.len() == LEN);
        print_allocated(self.received);
        Ok(())
    }
}

/// Waits for the line after the last message; returns the bytes allocated until then.
fn wait_for_allocated(process: &RoleProcess, what: &str) -> usize {
    loop {
        let line = process.read_line(what);
        let mut words = line.split(' ').skip_while(|word| *word != "allocated").skip(1);
        let count: Option<u64> = words.next().and_then(|word| word.parse().ok());
        if count.is_some_and(|count| count >= MESSAGES) {
            return words.next().and_then(|word| word.parse().ok()).unwrap();
        }
    }
}

#[test]
fn a_message_is_copied_once_into_its_slot_and_no_subscriber_copies_it() {
    let system = System::start();
    let start_reader = |kind, name, how: &str| {
        let link = format!("data={}.data{how}", system.name("publisher"));
        RoleProcess::start(&system, kind, name, &["--link", &link], None)
    };
    let readers = [
        start_reader("viewing-reader", "every", ",keep=all,patience=10s"),
        start_reader("viewing-reader", "newest", ",keep=latest"),
        start_reader("viewing-reader", "history", ",keep=all,patience=10s,history=3"),
    ];
    let decoding = start_reader("decoding-reader", "decoding", ",keep=all,patience=10s");
    let publisher =
        RoleProcess::start(&system, "large-publisher", "publisher", &["--rate", "20Hz"], None);
    for (reader, how) in readers.iter().zip(["all", "the newest", "all, and a history"]) {
        let bytes = wait_for_allocated(reader, how);
        println!("subscriber of {how}: {bytes} bytes allocated for {MESSAGES} messages of {LEN}");
        assert!(bytes < LEN, "{how}: {bytes} bytes are room for a copy of a message");
    }
    // What this counts: a subscriber that decodes copies each message, once.
    let bytes = wait_for_allocated(&decoding, "decoding");
    println!("subscriber that decodes: {bytes} bytes");
    let each = MESSAGES as usize * LEN;
    assert!((each..each + LEN).contains(&bytes), "{bytes} bytes, one copy for each message");
    // The slots are no memory of the allocator: the message itself is all that there is.
    let bytes = wait_for_allocated(&publisher, "publisher");
    println!("publisher: {bytes} bytes");
    assert!((LEN..2 * LEN).contains(&bytes), "{bytes} bytes: no copy next to that in the slot");
}
