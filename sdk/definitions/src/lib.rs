//! Message definitions as source text of Rust, Python, C and C++, and as JSON: the standard messages
//! and those of components, from their schemas.

mod c;
mod cpp;
mod definition;
mod export;
mod json;
mod python;
mod rust;
mod selection;

pub use c::write_c_header;
pub use cpp::write_cpp_header;
pub use definition::{Definition, standard_messages};
pub use export::{ExportError, Language, export_messages};
pub use python::write_python_module;
pub use selection::{Selection, name_of, select_messages};
