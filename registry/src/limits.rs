//! The limits on what the registry keeps, each with its reason.
//!
//! Together they bound its memory to some 150 MB under the worst clients; a robot of 200 components
//! and 1000 links needs 1 MB.

use std::time::Duration;

use armor_wire::codec::MAX_CONTROL_LEN;
use armor_wire::liveness::BEAT;

/// Registered processes: five times the largest system meant for one robot.
pub const MAX_COMPONENTS: usize = 1000;

/// Outputs of one process. More than that is a sign of names made up in a loop.
pub const MAX_DATA_PER_COMPONENT: usize = 256;

/// Outputs in total. With [`MAX_SCHEMA_LEN`] each: 64 MiB.
pub const MAX_DATA: usize = 4096;

/// Length of a schema as text in bytes: what `armor_wire::schema::parse` takes.
pub const MAX_SCHEMA_LEN: usize = armor_wire::schema::MAX_TEXT_LEN;

/// Length of the name of a type in bytes.
pub const MAX_TYPE_NAME_LEN: usize = 128;

/// Length of the name of a host in bytes, as in DNS.
pub const MAX_HOST_LEN: usize = 255;

/// Lookups of one connection that wait for a provider: an input each.
pub const MAX_WAITING_PER_CONNECTION: usize = 256;

/// Waiting lookups in total. With [`MAX_SCHEMA_LEN`] each: 64 MiB.
pub const MAX_WAITING: usize = 4096;

/// Connections that watch: each costs a message per process that comes or goes. The launcher, the
/// executive, and many open tools.
pub const MAX_WATCHERS: usize = 64;

/// Length of a listing in bytes; a longer one is sent without schemas, or refused. A third of what
/// a frame carries, because the reader's limit counts its strings and entries at their size in
/// memory.
pub const MAX_LISTING_LEN: usize = MAX_CONTROL_LEN / 3;

/// Length of the text of a refusal in bytes: a screenful. The types of others appear in it.
pub const MAX_REFUSAL_LEN: usize = 2048;

/// Most names that are suggested for a name that is not registered.
pub const MAX_SIMILAR: usize = 3;

/// A holder of a name that was not heard for this long, two beats and a half, gives it up when
/// another process registers under it: a restarted component does not wait for its dead
/// predecessor.
pub const GIVE_UP: Duration = BEAT.saturating_mul(2).saturating_add(Duration::from_millis(250));
