//! Ids of traces and spans. They follow from the process start and the number of the call, so that
//! two observers of one system agree.

/// Which span of a call.
#[derive(Clone, Copy)]
pub enum SpanPart {
    /// The call itself.
    Call = 1,
    /// From the publication of its message to its end.
    Hop = 2,
}

/// The id of a span; never 0.
pub fn span_id(instance: u64, call: u64, part: SpanPart) -> u64 {
    mix(mix(mix(instance) ^ call) ^ part as u64).max(1)
}

/// The id of the trace that begins with a call; never 0.
pub fn trace_id(instance: u64, call: u64) -> u128 {
    let half = |salt: u64| u128::from(mix(mix(mix(instance) ^ call) ^ salt));
    (half(3) << 64 | half(4)).max(1)
}

/// Mixes all bits of a number: the last step of SplitMix64 (Steele, Lea, Flood: Fast splittable
/// pseudorandom number generators, 2014).
fn mix(number: u64) -> u64 {
    let mixed = number.wrapping_add(0x9e37_79b9_7f4a_7c15);
    let mixed = (mixed ^ (mixed >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let mixed = (mixed ^ (mixed >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    mixed ^ (mixed >> 31)
}
