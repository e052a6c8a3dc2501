//! How glibc keeps freed memory in a process that runs for long. By default each thread has a pool of
//! its own, up to eight for each processor, and in front of it a cache for each size, from which nothing
//! returns: a launcher or an agent, whose threads come and go with components, grew for hours, until all
//! of them were full. One pool without caches stays as large as what is used at the same time.

use std::os::unix::process::CommandExt;
use std::process::Command;

use super::process::OWN_PROGRAM;

/// The variable that glibc reads before a program begins. Others ignore it.
pub const VARIABLE: &str = "GLIBC_TUNABLES";
/// None of these processes allocates at a rate at which its threads would wait for each other.
pub const ONE_POOL: &str = "glibc.malloc.arena_max=1:glibc.malloc.tcache_count=0";

/// Starts this program again, in this process, with one pool, unless the variable is set. Components do
/// not inherit it.
pub fn restart_with_one_pool() {
    if std::env::var_os(VARIABLE).is_some() {
        return;
    }
    let mut words = std::env::args_os();
    let name = words.next().unwrap_or_else(|| "armor".into());
    // It returns only where that is not possible; then the program runs as it is.
    let _ = Command::new(OWN_PROGRAM).arg0(name).args(words).env(VARIABLE, ONE_POOL).exec();
}
