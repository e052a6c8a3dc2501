//! The steps of the slot protocol, at each of which a test can end the process, to see that neither
//! end of a link is harmed by what the other one leaves undone.
//!
//! Only development builds have this: in a release build [`pass_step`] is empty.

macro_rules! steps {
    ($($name:ident $text:literal $doc:literal,)*) => {
        /// A step, named after what has just been done.
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        pub enum ProtocolStep {
            $(#[doc = $doc] $name,)*
        }

        impl ProtocolStep {
            /// All steps, those of the publisher first.
            pub const ALL: &'static [Self] = &[$(Self::$name,)*];

            /// Its name in [`KILL_VARIABLE`].
            pub fn name(self) -> &'static str {
                match self {
                    $(Self::$name => $text,)*
                }
            }
        }
    };
}

steps! {
    PageCreated "page-created" "Publisher: the subscriber has not been offered the page.",
    PageOffered "page-offered" "Publisher: the offer of the page has been sent, no slot yet.",
    SlotCreated "slot-created" "Publisher: the slot is in no pool.",
    SlotPlaced "slot-placed" "Publisher: a free slot was chosen, nothing is written.",
    HeaderWritten "header-written" "Publisher: the slot has a header and an old or no message.",
    SlotWritten "slot-written" "Publisher: the message is complete, no subscriber has it.",
    SlotOffered "slot-offered" "Publisher: the offer of the slot has been sent, no entry names it.",
    SlotLent "slot-lent" "Publisher: the subscriber holds the slot, but its ring does not have it.",
    CellExchanged "cell-exchanged" "Publisher: the entry is in its cell, but not counted.",
    EntryPushed "entry-pushed" "Publisher: the entry is in the ring; what it replaced is still lent.",
    EntryReplaced "entry-replaced" "Publisher: what it replaced has been released.",
    WakeClaimed "wake-claimed" "Publisher: it is to wake the subscriber, but has not.",
    SlotRemoved "slot-removed" "Publisher: the slot is in no pool any more; no link knows that.",
    PageMapped "page-mapped" "Subscriber: the page is mapped, no slot is.",
    SlotMapped "slot-mapped" "Subscriber: the slot is mapped, and not yet in its table.",
    EntrySeen "entry-seen" "Subscriber: the entry has been read, but not taken.",
    EntryTaken "entry-taken" "Subscriber: the entry is out of the ring; the slot is held.",
    MessageStored "message-stored" "Subscriber: the slot waits in the inbox or is in a history.",
    SlotReturning "slot-returning" "Subscriber: the message was used; the slot is still held.",
    SlotReturned "slot-returned" "Subscriber: the slot has been released.",
    SleepAnnounced "sleep-announced" "Subscriber: it is to be woken, and has not yet looked again.",
}

impl ProtocolStep {
    /// Whether it is a step of the publisher.
    pub fn is_of_publisher(self) -> bool {
        (self as usize) < (Self::PageMapped as usize)
    }
}

/// Names the step at which a process of a development build is killed, and at which of its passes:
/// `slot-lent 17`.
pub const KILL_VARIABLE: &str = "ARMOR_KILL_AT";

/// Ends the process with SIGKILL if [`KILL_VARIABLE`] names this pass of this step.
#[cfg(not(debug_assertions))]
#[inline(always)]
pub fn pass_step(_: ProtocolStep) {}

/// Ends the process with SIGKILL if [`KILL_VARIABLE`] names this pass of this step.
#[cfg(debug_assertions)]
pub fn pass_step(step: ProtocolStep) {
    use std::sync::LazyLock;
    use std::sync::atomic::{AtomicU32, Ordering};

    static ORDERED: LazyLock<Option<(String, AtomicU32)>> = LazyLock::new(|| {
        let order = std::env::var(KILL_VARIABLE).ok()?;
        let (name, pass) = order.split_once(' ')?;
        Some((name.to_owned(), AtomicU32::new(pass.parse().ok()?)))
    });
    let Some((name, passes)) = &*ORDERED else { return };
    if name == step.name() && passes.fetch_sub(1, Ordering::SeqCst) == 1 {
        // It does not return. Should it fail, the test waits for the death in vain and reports it.
        let _ =
            rustix::process::kill_process(rustix::process::getpid(), rustix::process::Signal::KILL);
    }
}
