//! What the names of a guard mean, and what can be wrong with one.

use std::ops::Range;

use crate::code::Code;
use crate::guard::measure::Measure;

/// The type of a value.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Type {
    Any,
    Truth,
    /// With the only texts that it can be, if they are known.
    Text(Option<Vec<String>>),
    Number(Measure),
}

/// The type and the domain of a name.
#[derive(Clone, Debug)]
pub(crate) struct Meaning {
    pub(crate) is: Type,
    /// Least and greatest value, in SI; only of a variable that has them.
    pub(crate) within: (f64, f64),
    /// Them in words, as written in the file.
    pub(crate) domain: String,
    /// Whether it is a field of data, or follows one.
    pub(crate) is_measured: bool,
}

/// Something wrong at a place in the guard's text.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct GuardProblem {
    pub(crate) code: Code,
    pub(crate) at: Range<usize>,
    pub(crate) message: String,
    pub(crate) remedy: String,
}
