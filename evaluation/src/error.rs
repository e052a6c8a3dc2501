//! Why an evaluation has no result.

/// Why a file cannot be evaluated.
#[derive(Debug, PartialEq, Eq, thiserror::Error)]
pub enum EvaluationError {
    /// A line has too few fields, or a field that is not a number.
    #[error("line {line}: {expected} expected, found `{text}`")]
    BadLine {
        /// Number of the line, from 1.
        line: usize,
        /// The expected fields.
        expected: &'static str,
        /// The line as it stands in the file.
        text: String,
    },
    /// Two files share neither a scan number nor a moment.
    #[error(
        "no scan of the trajectory is in the other file, neither by its number nor by its time; \
         are they from the same run?"
    )]
    NothingInCommon,
}
