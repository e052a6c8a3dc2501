//! Why a function cannot do what it was called for: a code, and a text that the thread keeps.

use std::cell::RefCell;
use std::error::Error;
use std::ffi::{CStr, CString, c_int};

use armor_sdk::foreign::PortTypeError;
use armor_sdk::testing::TestError;
use armor_sdk::{DataError, DeclareError, SendError, ValueError};

/// What a function returns: `ARMOR_ERROR_NONE`, or why it has done nothing. `armor_last_error` has the
/// details.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ArmorError {
    /// It has succeeded.
    None = 0,
    /// The component's own code has failed; see `armor_fail`.
    Failed = 1,
    /// A pointer that must be given is NULL.
    Null = 2,
    /// A text is not UTF-8.
    NotUtf8 = 3,
    /// A name is malformed.
    Name = 4,
    /// A port cannot be declared: twice, after `create`, or too many.
    Declaration = 5,
    /// The component has no such port.
    UnknownPort = 6,
    /// The port was declared with another type.
    OtherType = 7,
    /// The component is not active, so its threads publish nothing.
    NotActive = 8,
    /// The message is larger than a message can be.
    TooLarge = 9,
    /// The table that describes a struct is wrong.
    Table = 10,
    /// The bytes are not a message of the type.
    Malformed = 11,
    /// A parameter is unknown, has no value, or its value is of another type.
    Parameter = 12,
    /// A test cannot do what it asks for.
    Test = 13,
    /// A bug of the library.
    Internal = 14,
    /// The history has no such message, or the link of the input keeps no history.
    NoMessage = 15,
}

impl ArmorError {
    /// All codes.
    ///
    /// cbindgen:ignore
    pub(crate) const ALL: [Self; 16] = [
        Self::None,
        Self::Failed,
        Self::Null,
        Self::NotUtf8,
        Self::Name,
        Self::Declaration,
        Self::UnknownPort,
        Self::OtherType,
        Self::NotActive,
        Self::TooLarge,
        Self::Table,
        Self::Malformed,
        Self::Parameter,
        Self::Test,
        Self::Internal,
        Self::NoMessage,
    ];

    /// Its meaning, in one sentence.
    pub const fn text(self) -> &'static CStr {
        match self {
            Self::None => c"no error",
            Self::Failed => c"the component's code has failed",
            Self::Null => c"a pointer that must be given is NULL",
            Self::NotUtf8 => c"a text is not UTF-8",
            Self::Name => c"a name is malformed: use letters, digits, _ and -",
            Self::Declaration => c"the port cannot be declared",
            Self::UnknownPort => c"the component has no such port",
            Self::OtherType => c"the port was declared with another type",
            Self::NotActive => c"the component is not active",
            Self::TooLarge => c"the message is too large",
            Self::Table => c"the table that describes a struct is wrong",
            Self::Malformed => c"the bytes are not a message of the type",
            Self::Parameter => c"the parameter has no such value",
            Self::Test => c"the test cannot do this",
            Self::Internal => c"a bug of libarmor; please report it",
            Self::NoMessage => c"the history has no such message",
        }
    }

    /// The code of a number; `Failed` for one that is none.
    pub fn of_code(code: c_int) -> Self {
        Self::ALL.into_iter().find(|error| *error as c_int == code).unwrap_or(Self::Failed)
    }
}

/// A code with its details.
#[derive(Debug)]
pub(crate) struct Failure {
    pub code: ArmorError,
    pub text: String,
}

impl Failure {
    pub fn new(code: ArmorError, text: impl Into<String>) -> Self {
        Self { code, text: text.into() }
    }

    pub fn null(what: &str) -> Self {
        Self::new(ArmorError::Null, format!("{what} is NULL"))
    }
}

impl std::fmt::Display for Failure {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(&self.text)
    }
}

impl Error for Failure {}

/// Replaces what only a reader of Rust understands in a text of the SDK.
fn in_c_words(text: &str) -> String {
    text.replace("`new`", "the constructor (`create` in C)")
}

impl From<DeclareError> for Failure {
    fn from(error: DeclareError) -> Self {
        let code = match error {
            DeclareError::Name(_) => ArmorError::Name,
            _ => ArmorError::Declaration,
        };
        Self::new(code, in_c_words(&error.to_string()))
    }
}

impl From<DataError> for Failure {
    fn from(error: DataError) -> Self {
        let code = match error {
            DataError::UnknownInput { .. } | DataError::UnknownSource { .. } => {
                ArmorError::UnknownPort
            }
            DataError::OtherType { .. } => ArmorError::OtherType,
            DataError::Malformed { .. } => ArmorError::Malformed,
            DataError::NoHistory { .. } | DataError::SeveralSources { .. } => ArmorError::NoMessage,
        };
        let text = match &error {
            DataError::SeveralSources { input, sources } => {
                format!(
                    "input `{input}` has several sources: give one of them as `source`, of {sources}"
                )
            }
            error => error.to_string(),
        };
        Self::new(code, text)
    }
}

impl From<SendError> for Failure {
    fn from(error: SendError) -> Self {
        let code = match error {
            SendError::UnknownOutput { .. } | SendError::NotYetDeclared { .. } => {
                ArmorError::UnknownPort
            }
            SendError::NotActive { .. } => ArmorError::NotActive,
            SendError::WrongType { .. } => ArmorError::OtherType,
            SendError::NotEncoded { .. } => ArmorError::TooLarge,
        };
        Self::new(code, in_c_words(&error.to_string()))
    }
}

impl From<PortTypeError> for Failure {
    fn from(error: PortTypeError) -> Self {
        Self::new(ArmorError::Table, error.to_string())
    }
}

impl From<ValueError> for Failure {
    fn from(error: ValueError) -> Self {
        Self::new(ArmorError::Parameter, error.to_string())
    }
}

impl From<TestError> for Failure {
    fn from(error: TestError) -> Self {
        let code = match error {
            TestError::Failed { .. } => ArmorError::Failed,
            TestError::NoPort { .. } => ArmorError::UnknownPort,
            TestError::OtherType { .. } => ArmorError::OtherType,
            TestError::NotActive { .. } => ArmorError::NotActive,
            TestError::Parameter { .. } => ArmorError::Parameter,
            TestError::Encode(_) => ArmorError::TooLarge,
            TestError::Decode(_) => ArmorError::Malformed,
            _ => ArmorError::Test,
        };
        Self::new(code, error.to_string())
    }
}

thread_local! {
    static LAST: RefCell<Option<CString>> = const { RefCell::new(None) };
}

/// Keeps the details of this thread's last failure.
pub(crate) fn keep_last_error(text: &str) {
    let text = to_c_text(text);
    LAST.with(|last| *last.borrow_mut() = Some(text));
}

/// Forgets it, before a function of C is called: once for each message.
pub(crate) fn clear_last_error() {
    LAST.with(|last| drop(last.take()));
}

/// The details of this thread's last failure: a copy, and a pointer that is valid until the next one.
pub(crate) fn with_last_error<T>(read: impl FnOnce(&CStr) -> T) -> T {
    LAST.with(|last| read(last.borrow().as_deref().unwrap_or_default()))
}

/// A text that ends at its first NUL, as C reads it.
pub(crate) fn to_c_text(text: &str) -> CString {
    let end = text.find('\0').unwrap_or(text.len());
    CString::new(&text[..end]).unwrap_or_default()
}
