//! The languages in which a message can be written, and why it cannot be written in one.

use std::fmt;

use thiserror::Error;

use crate::definition::Definition;

/// A language for definitions of messages.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Language {
    /// Structs that derive `Message`.
    Rust,
    /// Classes of the package `armor`.
    Python,
    /// Structs with the tables of `armor.h`.
    C,
    /// Structs with the macros of `armor.hpp`.
    Cpp,
    /// One document with all fields.
    Json,
}

impl fmt::Display for Language {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Rust => "Rust",
            Self::Python => "Python",
            Self::C => "C",
            Self::Cpp => "C++",
            Self::Json => "JSON",
        })
    }
}

/// Why messages cannot be written.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
pub enum ExportError {
    /// A form that the language's package does not have.
    #[error("`{message}.{member}` is {form}, which messages in {language} cannot have: {remedy}")]
    Unsupported {
        /// The message.
        message: String,
        /// The field or variant.
        member: String,
        /// What it is.
        form: String,
        /// The language.
        language: Language,
        /// What to do.
        remedy: &'static str,
    },
    /// Two different messages with the same name.
    #[error(
        "two different messages are called `{name}`, and one file cannot define both: export them \
         one by one, or rename one"
    )]
    TwoMessages {
        /// Their name.
        name: String,
    },
}

impl ExportError {
    /// A member of `of` that the language cannot express.
    pub(crate) fn unsupported(
        of: &Definition,
        member: &str,
        form: impl Into<String>,
        language: Language,
    ) -> Self {
        let (message, member, form) = (of.name().into(), member.into(), form.into());
        let remedy = match language {
            Language::Rust | Language::Json => "rename it",
            _ => "export it with --lang rust, or give the message another form",
        };
        Self::Unsupported { message, member, form, language, remedy }
    }

    /// A member whose name is a word of the language.
    pub(crate) fn reserved(of: &Definition, member: &str, language: Language) -> Self {
        let (message, member) = (of.name().into(), member.into());
        let form = "a reserved word of the language".to_owned();
        Self::Unsupported { message, member, form, language, remedy: "rename it" }
    }
}
