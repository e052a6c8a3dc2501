//! The keys by which this process proves that the launcher of its run has started it.

use std::sync::OnceLock;

use armor_wire::run_key::{KEY_LEN, NameKey, RunSecret};

/// Has `NAME:KEY`, the name of the process and its key; for what serves or commands the whole system,
/// `*` and the secret of the run.
pub const KEY_VARIABLE: &str = "ARMOR_RUN_KEY";
/// In place of a name. No component has this name.
const ANY_NAME: &str = "*";

/// What this process has.
#[derive(Clone, Debug, PartialEq, Eq)]
enum HeldKey {
    Secret(RunSecret),
    OfName(String, NameKey),
}

/// The secret that this process has made.
static MADE: OnceLock<RunSecret> = OnceLock::new();

/// Draws a secret.
///
/// # Panics
/// If the kernel gives no random bytes, as [`random_id`](crate::random_id).
pub fn draw_secret() -> RunSecret {
    let mut bytes = [0; KEY_LEN];
    for half in bytes.chunks_mut(KEY_LEN / 2) {
        half.copy_from_slice(&crate::random_id().to_le_bytes());
    }
    RunSecret::new(bytes)
}

/// Gives this process, the launcher, the secret of its run. The first one counts.
pub fn adopt_secret(secret: RunSecret) {
    let _ = MADE.set(secret);
}

/// Returns the secret of the run, if this process has it.
pub fn own_secret() -> Option<RunSecret> {
    match held() {
        Some(HeldKey::Secret(secret)) => Some(secret),
        Some(HeldKey::OfName(..)) | None => None,
    }
}

/// Returns the key of a name, if this process has it; none in a process that was started by hand.
pub fn own_key(name: &str) -> Option<NameKey> {
    held()?.key_of(name)
}

/// Returns the value of [`KEY_VARIABLE`] for a process that has the secret.
pub fn format_secret(secret: RunSecret) -> String {
    format!("{ANY_NAME}:{secret}")
}

/// Returns the value of [`KEY_VARIABLE`] for the process of one name.
pub fn format_key(name: &str, secret: RunSecret) -> String {
    format!("{name}:{}", secret.key_of(name))
}

/// Reads the key of a name from a value of [`KEY_VARIABLE`].
pub fn read_key(text: &str, name: &str) -> Option<NameKey> {
    HeldKey::read(text)?.key_of(name)
}

fn held() -> Option<HeldKey> {
    static SET: OnceLock<Option<HeldKey>> = OnceLock::new();
    if let Some(secret) = MADE.get() {
        return Some(HeldKey::Secret(*secret));
    }
    SET.get_or_init(|| HeldKey::read(&std::env::var(KEY_VARIABLE).ok()?)).clone()
}

impl HeldKey {
    fn read(text: &str) -> Option<Self> {
        match text.split_once(':')? {
            (ANY_NAME, secret) => secret.parse().ok().map(Self::Secret),
            (name, key) => Some(Self::OfName(name.to_owned(), key.parse().ok()?)),
        }
    }

    fn key_of(&self, name: &str) -> Option<NameKey> {
        match self {
            Self::Secret(secret) => Some(secret.key_of(name)),
            Self::OfName(own, key) => (own == name).then_some(*key),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_process_has_the_key_of_its_own_name_or_all() {
        let secret = draw_secret();
        assert_ne!(secret, draw_secret());
        let own = format_key("driver", secret);
        assert_eq!(read_key(&own, "driver"), Some(secret.key_of("driver")));
        assert_eq!(read_key(&own, "planner"), None);
        assert_eq!(read_key(&format_secret(secret), "planner"), Some(secret.key_of("planner")));
        assert_eq!(HeldKey::read(&format_secret(secret)), Some(HeldKey::Secret(secret)));
        for wrong in ["", "driver", "driver:", "driver:12", "*:x"] {
            assert_eq!(HeldKey::read(wrong), None, "{wrong}");
        }
    }
}
