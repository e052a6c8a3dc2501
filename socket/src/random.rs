//! Ids that nobody else has.

/// A random id that is never 0, which means "any" wherever ids are compared.
///
/// # Panics
/// If the kernel has no random numbers, which Linux has from its start on.
pub fn random_id() -> u64 {
    getrandom::u64().expect("the kernel hands out random numbers").max(1)
}
