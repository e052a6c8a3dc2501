//! A directory of PMTiles: which tiles are where.

use crate::limits::MAX_DIRECTORY_ENTRIES;

/// Some successive tiles with the same bytes, or a directory of further ones.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct DirectoryEntry {
    tile_id: u64,
    /// 0 for a directory.
    run_length: u32,
    pub(crate) len: u32,
    /// From the beginning of the tiles, or of the leaf directories.
    pub(crate) offset: u64,
}

/// Entries, by their tiles.
pub(crate) struct TileDirectory(Vec<DirectoryEntry>);

impl DirectoryEntry {
    pub(crate) fn is_leaf(self) -> bool {
        self.run_length == 0
    }
}

impl TileDirectory {
    /// The entry of a tile, or the directory that may have it.
    pub(crate) fn find(&self, tile_id: u64) -> Option<DirectoryEntry> {
        let after = self.0.partition_point(|entry| entry.tile_id <= tile_id);
        let entry = *self.0.get(after.checked_sub(1)?)?;
        let is_within = tile_id - entry.tile_id < u64::from(entry.run_length);
        (entry.is_leaf() || is_within).then_some(entry)
    }
}

/// Reads a directory: the number of entries, then all differences of tiles, all lengths of runs,
/// all sizes and all offsets.
pub(crate) fn parse_directory(mut bytes: &[u8]) -> Result<TileDirectory, String> {
    let short = || "it ends early".to_owned();
    let mut number = || take_number(&mut bytes).ok_or_else(short);
    let count = number()?;
    let count = usize::try_from(count)
        .ok()
        .filter(|count| *count <= MAX_DIRECTORY_ENTRIES)
        .ok_or_else(|| format!("it has {count} entries, more than {MAX_DIRECTORY_ENTRIES}"))?;
    let mut entries = Vec::new();
    let mut tile_id = 0_u64;
    for index in 0..count {
        let step = number()?;
        let next = tile_id.checked_add(step).filter(|_| index == 0 || step > 0);
        tile_id = next.ok_or("its tiles are not in order")?;
        entries.push(DirectoryEntry { tile_id, run_length: 0, len: 0, offset: 0 });
    }
    for entry in &mut entries {
        let run_length = u32::try_from(number()?).ok();
        entry.run_length = run_length.ok_or("a run of tiles is too long")?;
    }
    for entry in &mut entries {
        let len = u32::try_from(number()?).ok().filter(|len| *len > 0);
        entry.len = len.ok_or("an entry has no bytes, or too many")?;
    }
    // 0: right after the entry before.
    let mut after_last = None;
    for entry in &mut entries {
        entry.offset = match number()? {
            0 => after_last.ok_or("its first entry has no place")?,
            place => place - 1,
        };
        after_last = entry.offset.checked_add(entry.len.into());
    }
    Ok(TileDirectory(entries))
}

/// Takes a number of seven bits in each byte, the lowest first.
fn take_number(bytes: &mut &[u8]) -> Option<u64> {
    let mut number = 0;
    for shift in (0..64).step_by(7) {
        let (&byte, rest) = bytes.split_first()?;
        *bytes = rest;
        let bits = u64::from(byte & 0x7f);
        // The tenth byte has one bit.
        if shift == 63 && bits > 1 {
            return None;
        }
        number |= bits << shift;
        if byte < 0x80 {
            return Some(number);
        }
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn runs_and_leaves_are_found() {
        // Tiles 5 to 7 at 0 with 10 bytes, tile 20 after them, a directory from tile 300.
        let bytes = [3, 5, 15, 0x98, 0x02, 3, 1, 0, 10, 4, 7, 1, 0, 1];
        let directory = parse_directory(&bytes).unwrap();
        let found = |id| directory.find(id).map(|entry| (entry.offset, entry.len, entry.is_leaf()));
        assert_eq!(found(4), None);
        assert_eq!(found(5), Some((0, 10, false)));
        assert_eq!(found(7), Some((0, 10, false)));
        assert_eq!(found(8), None);
        assert_eq!(found(20), Some((10, 4, false)));
        assert_eq!(found(21), None);
        assert_eq!(found(u64::MAX), Some((0, 7, true)));
    }

    #[test]
    fn a_damaged_directory_is_refused() {
        for (bytes, part) in [
            (&[][..], "early"),
            (&[2, 5], "early"),
            (&[2, 5, 0, 1, 1, 1, 1, 1, 1], "order"),
            (&[1, 5, 1, 0, 1], "no bytes"),
            (&[1, 5, 1, 9, 0], "no place"),
            (&[0xff, 0xff, 0xff, 0x7f], "entries"),
            (&[0xff; 11], "early"),
        ] {
            let what = parse_directory(bytes).err().unwrap();
            assert!(what.contains(part), "{bytes:?}: {what}");
        }
    }
}
