//! All channels: the outputs that the registry lists, and what changed among them.

use std::collections::BTreeMap;
use std::sync::Arc;
use std::time::{Duration, Instant};

use armor_recording::OutputSelection;
use armor_wire::registry::DataEntry;

use super::channel::ViewerChannel;

/// Time for which a channel stays whose output is gone: a component that is restarted is back by
/// then.
const GONE_AFTER: Duration = Duration::from_secs(5);

/// The channels by their outputs.
pub(super) struct ChannelTable {
    selection: OutputSelection,
    channels: BTreeMap<String, TabledChannel>,
    /// The number of the next channel: a viewer keeps what it knows of a number.
    next_id: u32,
}

struct TabledChannel {
    channel: Arc<ViewerChannel>,
    seen: Instant,
}

/// What a listing has changed.
#[derive(Default)]
pub(super) struct ChannelChanges {
    pub(super) added: Vec<Arc<ViewerChannel>>,
    pub(super) removed: Vec<Arc<ViewerChannel>>,
}

impl ChannelTable {
    /// Returns a table without channels, which will have those of `selection`.
    pub(super) fn new(selection: OutputSelection) -> Self {
        Self { selection, channels: BTreeMap::new(), next_id: 1 }
    }

    /// Takes a listing, and returns what changed with it.
    pub(super) fn update(&mut self, listed: Vec<DataEntry>, now: Instant) -> ChannelChanges {
        let mut changes = ChannelChanges::default();
        let selection = &self.selection;
        for entry in listed.into_iter().filter(|entry| selection.holds(&entry.data)) {
            if let Some(known) = self.channels.get_mut(&entry.data)
                && known.channel.entry == entry
            {
                known.seen = now;
                continue;
            }
            let channel = match ViewerChannel::new(self.next_id, entry) {
                Ok(channel) => Arc::new(channel),
                Err(error) => {
                    tracing::debug!("an output is not shown: {error}");
                    continue;
                }
            };
            self.next_id += 1;
            let tabled = TabledChannel { channel: Arc::clone(&channel), seen: now };
            let data = channel.entry.data.clone();
            // The same output with another type is another channel.
            changes.removed.extend(self.channels.insert(data, tabled).map(|old| old.channel));
            changes.added.push(channel);
        }
        self.channels.retain(|_, tabled| {
            let is_gone = now.saturating_duration_since(tabled.seen) >= GONE_AFTER;
            if is_gone {
                changes.removed.push(Arc::clone(&tabled.channel));
            }
            !is_gone
        });
        changes
    }

    /// Returns the channel with a number.
    pub(super) fn find(&self, id: u32) -> Option<&Arc<ViewerChannel>> {
        self.channels.values().map(|tabled| &tabled.channel).find(|channel| channel.id == id)
    }

    /// Returns all channels.
    pub(super) fn channels(&self) -> impl Iterator<Item = &Arc<ViewerChannel>> {
        self.channels.values().map(|tabled| &tabled.channel)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn entry(data: &str, schema: &str) -> DataEntry {
        let type_name = "T".into();
        DataEntry { data: data.into(), type_name, schema: schema.into(), latched: false }
    }

    fn ids(channels: &[Arc<ViewerChannel>]) -> Vec<u32> {
        channels.iter().map(|channel| channel.id).collect()
    }

    #[test]
    fn a_channel_keeps_its_number_while_its_output_has_its_type() {
        let selection = OutputSelection { exclude: vec!["b.*".into()], ..Default::default() };
        let mut table = ChannelTable::new(selection);
        let start = Instant::now();
        let all = vec![entry("a.x", "f64"), entry("b.y", "f64"), entry("a.z", "no schema")];
        assert_eq!(ids(&table.update(all, start).added), [1], "the others are left out");
        let changes = table.update(vec![entry("a.x", "f64")], start);
        assert!(changes.added.is_empty() && changes.removed.is_empty());
        let changes = table.update(vec![entry("a.x", "f32")], start);
        assert_eq!((ids(&changes.added), ids(&changes.removed)), (vec![2], vec![1]));
        assert!(table.find(1).is_none() && table.find(2).is_some());
        assert!(table.update(vec![], start).removed.is_empty(), "it may come back");
        let changes = table.update(vec![], start + GONE_AFTER);
        assert_eq!(ids(&changes.removed), [2]);
    }
}
