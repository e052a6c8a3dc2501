//! Message definitions as source text of Rust, Python, C and C++, and as JSON: the standard messages
//! and those of components, from their schemas.

mod c;
mod cpp;
mod definition;
mod export;
mod json;
mod language;
mod python;
mod rust;
mod selection;

pub use c::write_c_header;
pub use cpp::write_cpp_header;
pub use definition::{Definition, name_of, standard_messages};
pub use export::export_messages;
pub use language::{ExportError, Language};
pub use python::write_python_module;
pub use selection::{Selection, select_messages};
