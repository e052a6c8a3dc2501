//! How glibc keeps and copies memory in a process that runs for long.
//!
//! By default each thread has a pool of freed memory of its own, up to eight for each processor, and in
//! front of it a cache for each size, from which nothing returns: a launcher or an agent, whose threads
//! come and go with components, grew for hours, until all of them were full. One pool without caches
//! stays as large as what is used at the same time.
//!
//! Copies of more than 2 KiB are made with `rep movsb` where the processor calls it fast. AMD's do, and
//! then copy 16 KiB to an address that is not a multiple of 16 with 1 to 1.5 GB/s in place of 20; what a
//! gate decrypts is copied so. Vector instructions have no such addresses.

use std::os::unix::process::CommandExt;
use std::process::Command;

use super::process::OWN_PROGRAM;

/// The variable that glibc reads before a program begins. Others ignore it.
pub const VARIABLE: &str = "GLIBC_TUNABLES";
/// None of these processes allocates at a rate at which its threads would wait for each other. No copy
/// is as long as the last number, 1 GiB.
pub const SETTINGS: &str = "glibc.malloc.arena_max=1:glibc.malloc.tcache_count=0:\
                            glibc.cpu.x86_rep_movsb_threshold=1073741824";

/// Starts this program again, in this process, with these settings, unless the variable is set.
/// Components do not inherit it.
pub fn restart_with_settings() {
    if std::env::var_os(VARIABLE).is_some() {
        return;
    }
    let mut words = std::env::args_os();
    let name = words.next().unwrap_or_else(|| "armor".into());
    // It returns only where that is not possible; then the program runs as it is.
    let _ = Command::new(OWN_PROGRAM).arg0(name).args(words).env(VARIABLE, SETTINGS).exec();
}

/// Keeps these settings from a program that the user has named; what the user has set is inherited.
pub fn remove_settings(command: &mut Command) {
    if std::env::var_os(VARIABLE).is_some_and(|value| value == SETTINGS) {
        command.env_remove(VARIABLE);
    }
}
