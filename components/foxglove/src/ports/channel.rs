//! One output of the robot as a channel of the viewers. Its data are read while a client wants them,
//! by one thread, and encoded once for all clients.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::thread;
use std::time::{Duration, Instant};

use armor_recording::ros::RosMessage;
use armor_sdk::directory::Directory;
use armor_sdk::tap::{Tap, TapData, TapError};
use armor_wire::keep::Keep;
use armor_wire::registry::DataEntry;
use armor_wire::schema;
use parking_lot::Mutex;

use super::commander::Commander;
use crate::outbox::{ViewerOutbox, ViewerSample};
use crate::viewer_protocol::AnnouncedChannel;

/// What a provider keeps for this process; never `all`, for which the provider waits.
const KEEP: Keep = Keep::Last { count: 100 };
/// Time after the last client until the link ends, so that a reload makes no new one.
const LINGER: Duration = Duration::from_secs(3);
/// How long to wait for data before checking whether a client is left.
const LOOK_EVERY: Duration = Duration::from_millis(250);
/// How long one attempt waits for a provider.
const PROVIDER_WITHIN: Duration = Duration::from_secs(1);
/// Stack of the thread that reads one output.
const STACK_LEN: usize = 512 << 10;

/// An output with its form in ROS 2.
pub(super) struct ViewerChannel {
    pub(super) id: u32,
    pub(super) entry: DataEntry,
    message: RosMessage,
    readers: Mutex<ChannelReaders>,
    /// Messages lost on the link to this process.
    lost: AtomicU64,
    has_warned: AtomicBool,
}

#[derive(Default)]
struct ChannelReaders {
    readers: Vec<ChannelReader>,
    /// The last value of a latched output, while it is read.
    newest: Option<Arc<ViewerSample>>,
    is_followed: bool,
    /// Publisher and number of the last message.
    last: Option<(u64, u64)>,
}

/// Where data come from, and the clock by which they arrive.
#[derive(Clone)]
pub(super) struct ChannelSource {
    pub(super) directory: Directory,
    pub(super) commander: Arc<Commander>,
}

/// A subscription of a client.
pub(super) struct ChannelReader {
    pub(super) client: u64,
    pub(super) subscription: u32,
    pub(super) outbox: Arc<ViewerOutbox>,
}

impl ViewerChannel {
    /// Returns the channel of an output.
    ///
    /// # Errors
    /// If its schema cannot be read.
    pub(super) fn new(id: u32, entry: DataEntry) -> Result<Self, schema::ParseError> {
        let message = RosMessage::new(&schema::parse(&entry.schema)?);
        let readers = Mutex::default();
        let (lost, has_warned) = Default::default();
        Ok(Self { id, entry, message, readers, lost, has_warned })
    }

    /// Returns what clients are informed of.
    pub(super) fn announce(&self) -> AnnouncedChannel<'_> {
        AnnouncedChannel {
            id: self.id,
            topic: &self.entry.data,
            schema_name: self.message.name(),
            schema: self.message.definition(),
        }
    }

    /// Adds a reader; the first one makes the link. A later one gets the last value of a latched
    /// output immediately.
    pub(super) fn add_reader(self: &Arc<Self>, source: &ChannelSource, reader: ChannelReader) {
        let mut readers = self.readers.lock();
        if let Some(newest) = &readers.newest {
            reader.outbox.push_sample(reader.subscription, true, newest);
        }
        readers.readers.push(reader);
        if readers.is_followed {
            return;
        }
        let link = ChannelLink { source: source.clone(), channel: Arc::clone(self) };
        let started = thread::Builder::new()
            .name("foxglove-data".into())
            .stack_size(STACK_LEN)
            .spawn(move || link.follow_output());
        match started {
            Ok(_) => readers.is_followed = true,
            Err(error) => {
                tracing::warn!(
                    "{} is not shown: no thread can be started: {error}",
                    self.entry.data
                );
            }
        }
    }

    /// Removes the readers that `is_gone` selects.
    pub(super) fn remove_readers(&self, is_gone: impl Fn(&ChannelReader) -> bool) {
        self.readers.lock().readers.retain(|reader| !is_gone(reader));
    }

    /// Returns how many messages were lost on the link to this process.
    pub(super) fn lost(&self) -> u64 {
        self.lost.load(Ordering::Relaxed)
    }

    /// Gives a message that has arrived at system time `now_s` to all readers.
    fn distribute(&self, data: &TapData, now_s: f64) {
        let mut readers = self.readers.lock();
        let (instance, sequence) = (data.header.instance, data.header.sequence);
        // A latched value is sent again at the start of each link.
        if readers.last.is_some_and(|(same, last)| same == instance && sequence <= last) {
            return;
        }
        readers.last = Some((instance, sequence));
        self.lost.fetch_add(data.lost, Ordering::Relaxed);
        let encoded = match self.message.encode(&data.payload) {
            Ok(encoded) => encoded,
            Err(error) => {
                if !self.has_warned.swap(true, Ordering::Relaxed) {
                    tracing::warn!("a message of {} is not shown: {error}", self.entry.data);
                }
                return;
            }
        };
        // The stamp of the component that brings the system's time is the host's.
        let stamp_ns = to_nanoseconds(now_s);
        let sample = Arc::new(ViewerSample { stamp_ns, payload: encoded.bytes });
        for reader in &readers.readers {
            reader.outbox.push_sample(reader.subscription, self.entry.latched, &sample);
        }
        if self.entry.latched {
            readers.newest = Some(sample);
        }
    }
}

/// Returns a time in nanoseconds; 0 if it is not known.
pub(super) fn to_nanoseconds(time_s: f64) -> u64 {
    // A cast saturates: what is negative or no number becomes 0.
    (time_s * 1e9).round() as u64
}

/// The thread that reads one output.
struct ChannelLink {
    source: ChannelSource,
    channel: Arc<ViewerChannel>,
}

impl ChannelLink {
    fn follow_output(self) {
        let mut left = None;
        while !self.is_over(&mut left) {
            match Tap::open(&self.source.directory, &self.channel.entry.data, KEEP, PROVIDER_WITHIN)
            {
                Ok(tap) => {
                    // Whatever ends it, the next attempt finds whether there is a provider again.
                    let _ = self.read_tap(tap, &mut left);
                }
                // A refusal arrives immediately.
                Err(_) => thread::sleep(LOOK_EVERY),
            }
        }
    }

    fn read_tap(&self, mut tap: Tap, left: &mut Option<Instant>) -> Result<(), TapError> {
        // Data of another type than announced belong to another channel, which the next listing makes.
        if tap.schema().to_string() != self.channel.entry.schema {
            thread::sleep(LOOK_EVERY);
            return Ok(());
        }
        while !self.is_over(left) {
            if let Some(data) = tap.next(LOOK_EVERY)? {
                self.channel.distribute(&data, self.source.commander.timestamp());
            }
        }
        Ok(())
    }

    /// Returns whether the last reader has left long ago. The next one makes a new link then.
    fn is_over(&self, left: &mut Option<Instant>) -> bool {
        let mut readers = self.channel.readers.lock();
        if !readers.is_followed {
            return true;
        }
        if !readers.readers.is_empty() {
            *left = None;
            return false;
        }
        if left.get_or_insert_with(Instant::now).elapsed() < LINGER {
            return false;
        }
        *readers = ChannelReaders::default();
        true
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_that_are_unknown_become_zero() {
        assert_eq!(to_nanoseconds(1.5), 1_500_000_000);
        assert_eq!(to_nanoseconds(-1.0), 0);
        assert_eq!(to_nanoseconds(f64::NAN), 0);
    }
}
