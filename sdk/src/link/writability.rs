//! Waits until streams take bytes again.

use std::sync::Arc;
use std::time::Duration;

use armor_socket::Stream;
use rustix::event::{PollFd, PollFlags, Timespec, poll};

/// Longest rest where the system cannot wait for the streams. They still take bytes then.
const POLL_REST: Duration = Duration::from_millis(1);

/// Waits until one of `streams` takes bytes, for `limit` at most, which is less than a second.
pub(crate) fn wait_until_writable(streams: &[Arc<Stream>], limit: Duration) {
    wait_or_rest(streams, limit, std::thread::sleep);
}

/// As [`wait_until_writable`]. Calls `rest` where poll(2) fails, so that the caller's loop does not spin:
/// it does if the limit of file descriptors was lowered below the number of streams.
fn wait_or_rest(streams: &[Arc<Stream>], limit: Duration, rest: impl FnOnce(Duration)) {
    let mut fds: Vec<_> = streams.iter().map(|s| PollFd::new(&**s, PollFlags::OUT)).collect();
    let wait = Timespec { tv_sec: 0, tv_nsec: i64::from(limit.subsec_nanos()) };
    if poll(&mut fds, Some(&wait)).is_err() {
        rest(limit.min(POLL_REST));
    }
}

#[cfg(test)]
mod tests {
    use std::os::unix::net::UnixStream;

    use rustix::process::{Resource, Rlimit, getrlimit, setrlimit};

    use super::*;

    #[test]
    fn a_sender_rests_if_the_system_cannot_wait_for_its_streams() {
        // More than the tests need, and few enough for a list.
        let most = 1 << 16;
        let before = getrlimit(Resource::Nofile);
        let current = before.current.map_or(most, |current| current.min(most));
        setrlimit(Resource::Nofile, Rlimit { current: Some(current), ..before }).unwrap();
        let (near, _far) = UnixStream::pair().unwrap();
        let stream = Arc::new(Stream::Unix(near));
        let rest_after = |streams: u64, limit: Duration| {
            let streams = vec![Arc::clone(&stream); usize::try_from(streams).unwrap()];
            let mut rested = None;
            wait_or_rest(&streams, limit, |time| rested = Some(time));
            rested
        };
        let (short, long) = (Duration::from_micros(50), Duration::from_millis(20));
        assert_eq!(rest_after(1, long), None, "it takes bytes");
        assert_eq!(rest_after(current + 1, long), Some(POLL_REST));
        assert_eq!(rest_after(current + 1, short), Some(short));
    }
}
