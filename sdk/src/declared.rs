//! The type of an input, as its component declares it.

/// The type that an input was declared with.
#[derive(Clone, Copy, Debug)]
pub(crate) struct DeclaredType<'a> {
    pub input: &'a str,
    pub name: &'static str,
    pub schema_hash: u64,
}
