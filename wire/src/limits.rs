//! The largest lengths of frames and values.

/// Largest handshake or control body in bytes. It carries at most two schemas and a status.
pub const MAX_CONTROL_LEN: usize = 1 << 20;
/// Largest first frame of a connection in bytes: a peer that has not completed its handshake costs
/// no more than this.
pub const MAX_HELLO_LEN: usize = 64 << 10;
/// Largest body of the frame with which a gate begins a connection, in bytes: a name and its rights.
pub const MAX_PREFACE_LEN: usize = 16 << 10;
/// Bytes of a secret, a key and a proof of a run.
pub const KEY_LEN: usize = 16;
/// Largest data payload in bytes: an 8 MiB image or a 4096 x 4096 map with room to spare.
pub const MAX_DATA_LEN: usize = 64 << 20;
/// Largest `N` of a `[T; N]` that can be sent.
pub const MAX_FIXED_COUNT: usize = 1 << 16;
