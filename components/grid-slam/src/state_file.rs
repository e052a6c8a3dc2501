//! The file of the mapper's state: written by a thread of its own, so that no scan waits for the
//! disk.

use std::fs::{File, OpenOptions};
use std::io::{self, Read, Write};
use std::path::Path;
use std::sync::mpsc::{Receiver, RecvTimeoutError, SyncSender, TrySendError, sync_channel};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use armor_files::{create_private_folder, open_own_file, save_private_file};

/// Larger files are not read, bytes.
const MAX_LEN: u64 = 1 << 30;
/// Batches that wait for the disk; further ones are put together until one of these is written.
const MAX_WAITING: usize = 2;
/// Time between two waits for the disk. What is written survives the end of the process; only a
/// failure of the power needs more.
const SYNC_PERIOD: Duration = Duration::from_secs(1);

/// A file that grows by batches.
#[derive(Debug)]
pub(crate) struct StateFile {
    sender: Option<SyncSender<Vec<u8>>>,
    writer: Option<JoinHandle<()>>,
    /// What the queue had no room for.
    waiting: Vec<u8>,
}

/// Reads the file; `None` if there is none.
///
/// # Errors
/// If it cannot be read, or is too large to be a state.
pub(crate) fn read_state(path: &Path) -> io::Result<Option<Vec<u8>>> {
    let file = match File::open(path) {
        Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(None),
        file => file?,
    };
    let mut bytes = Vec::new();
    file.take(MAX_LEN + 1).read_to_end(&mut bytes)?;
    if bytes.len() as u64 > MAX_LEN {
        return Err(io::Error::other("it is too large"));
    }
    Ok(Some(bytes))
}

/// Replaces the file. It is on the disk when this returns.
///
/// # Errors
/// If it cannot be written.
pub(crate) fn replace_state(path: &Path, content: &[u8]) -> io::Result<()> {
    if let Some(folder) = path.parent() {
        create_private_folder(folder)?;
    }
    save_private_file(path, content).map_err(|error| error.reason)
}

impl StateFile {
    /// Replaces the file by one that has only a header. It is on the disk when this returns.
    ///
    /// # Errors
    /// If it cannot be written.
    pub(crate) fn begin(path: &Path, header: &[u8]) -> io::Result<Self> {
        replace_state(path, header)?;
        Self::resume(path, header.len())
    }

    /// Continues the file after `len` bytes; what follows them is removed.
    ///
    /// # Errors
    /// If it cannot be written.
    pub(crate) fn resume(path: &Path, len: usize) -> io::Result<Self> {
        let file = open_own_file(path, OpenOptions::new().append(true))?;
        file.set_len(len as u64)?;
        let (sender, batches) = sync_channel(MAX_WAITING);
        let writer = std::thread::Builder::new()
            .name("state".into())
            .spawn(move || write_batches(file, &batches))?;
        Ok(Self { sender: Some(sender), writer: Some(writer), waiting: Vec::new() })
    }

    /// Adds a batch, without waiting for the disk.
    pub(crate) fn add_batch(&mut self, batch: Vec<u8>) {
        self.waiting.extend(batch);
        if self.waiting.is_empty() {
            return;
        }
        let Some(sender) = &self.sender else { return };
        match sender.try_send(std::mem::take(&mut self.waiting)) {
            Ok(()) => {}
            Err(TrySendError::Full(batch)) => self.waiting = batch,
            // The thread has logged why it ended.
            Err(TrySendError::Disconnected(_)) => self.sender = None,
        }
    }
}

impl Drop for StateFile {
    /// Writes what waits.
    fn drop(&mut self) {
        if let Some(sender) = self.sender.take() {
            let _ = sender.send(std::mem::take(&mut self.waiting));
        }
        if let Some(writer) = self.writer.take() {
            let _ = writer.join();
        }
    }
}

fn write_batches(mut file: File, batches: &Receiver<Vec<u8>>) {
    if let Err(error) = try_write_batches(&mut file, batches) {
        // Later batches would not fit what is there.
        tracing::warn!(
            "the state of the map is written no more: {error}; a mapper that is restarted \
             continues from an older state, or begins a new frame"
        );
    }
}

/// Writes until no batch can follow; then all of them are on the disk.
fn try_write_batches(file: &mut File, batches: &Receiver<Vec<u8>>) -> io::Result<()> {
    let mut synced: Option<Instant> = None;
    while let Ok(batch) = batches.recv() {
        file.write_all(&batch)?;
        // Further batches until the disk may be asked again.
        let rest = |synced: Instant| SYNC_PERIOD.saturating_sub(synced.elapsed());
        while let Some(wait) = synced.map(rest).filter(|wait| !wait.is_zero()) {
            match batches.recv_timeout(wait) {
                Ok(batch) => file.write_all(&batch)?,
                Err(RecvTimeoutError::Timeout | RecvTimeoutError::Disconnected) => break,
            }
        }
        file.sync_data()?;
        synced = Some(Instant::now());
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_grows_by_batches_and_continues_after_its_last_whole_one() -> io::Result<()> {
        let name = format!("armor-grid-slam-{}-state", std::process::id());
        let folder = std::env::temp_dir().join(name);
        let path = folder.join("states").join("mapper.state");
        assert_eq!(read_state(&path)?, None);
        let mut file = StateFile::begin(&path, b"header ")?;
        for number in 0..20 {
            file.add_batch(format!("{number} ").into_bytes());
        }
        drop(file);
        let all = "header 0 1 2 3 4 5 6 7 8 9 10 11 12 13 14 15 16 17 18 19 ";
        assert_eq!(read_state(&path)?.as_deref(), Some(all.as_bytes()));
        let mut file = StateFile::resume(&path, "header 0 1 ".len())?;
        file.add_batch(b"end".to_vec());
        drop(file);
        assert_eq!(read_state(&path)?.as_deref(), Some(&b"header 0 1 end"[..]));
        std::fs::remove_dir_all(&folder)
    }
}
