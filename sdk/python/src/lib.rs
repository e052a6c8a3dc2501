//! The native part of the Python package `armor`: components, their messages, and components under
//! test. `python/armor` is what users see; this module is `armor._armor`.

mod any;
mod array;
mod component;
mod declaration;
mod decode;
mod encode;
mod fault;
mod handle;
mod header;
mod history;
mod layout;
mod observe;
mod outcome;
mod tested;
mod values;

use pyo3::prelude::*;

#[pymodule]
mod _armor {
    #[pymodule_export]
    use crate::any::PythonAnyMessage;
    #[pymodule_export]
    use crate::component::{log, manifest, mark_fork, run};
    #[pymodule_export]
    use crate::fault::{ArmorError, DeclareError, EndedError, MessageError, SendError, TestError};
    #[pymodule_export]
    use crate::handle::Handle;
    #[pymodule_export]
    use crate::header::PythonHeader;
    #[pymodule_export]
    use crate::history::{PythonHistory, PythonPast};
    #[pymodule_export]
    use crate::layout::{Layout, check_unit, decode, encode};
    #[pymodule_export]
    use crate::observe::{DataFeed, DataPublisher, SystemObserver, schema_parts};
    #[pymodule_export]
    use crate::outcome::{PythonCall, PythonOutcome};
    #[pymodule_export]
    use crate::tested::Tested;
}
