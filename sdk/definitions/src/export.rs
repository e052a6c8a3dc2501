//! The selected messages in a language.

use crate::language::{ExportError, Language};
use crate::selection::Selection;
use crate::{c, cpp, json, python, rust};

/// Returns the source text that defines the selected messages.
///
/// # Errors
/// If a message has a field that the language cannot express.
pub fn export_messages(selection: &Selection, language: Language) -> Result<String, ExportError> {
    let Selection { defined, imported } = selection;
    match language {
        Language::Rust => rust::export(defined, imported),
        Language::Python => python::export(defined, imported),
        Language::C => c::export(defined),
        Language::Cpp => cpp::export(defined, imported),
        Language::Json => Ok(json::export(defined, imported)),
    }
}
