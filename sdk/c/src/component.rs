//! A component of C as the SDK calls it.

use std::ffi::{CString, c_char, c_int};
use std::sync::Arc;

use armor_sdk::foreign::{ForeignArmor, ForeignComponent, PortType};
use armor_sdk::wire::schema;
use armor_sdk::{Call, Data, Fault, Header, Outcome, Value};
use parking_lot::RwLock;

use crate::boundary::{
    ArmorData, ArmorHandle, ArmorValue, CFunctions, flush_printed, read_outcome,
};
use crate::declaration::{ArmorCall, ArmorHeader};
use crate::failure::{ArmorError, Failure, keep_last_error, to_c_text, with_last_error};
use crate::layout::Layout;

/// A port, as C has declared it.
#[derive(Debug)]
pub(crate) struct DeclaredPort {
    pub of: PortType,
}

/// What the functions of C need of a component; its threads share it.
pub(crate) struct ComponentParts {
    pub armor: ForeignArmor,
    // Searched for each message: a few short lists are faster than maps.
    outputs: RwLock<Vec<(String, Arc<DeclaredPort>)>>,
    inputs: RwLock<Vec<(String, Arc<DeclaredPort>)>>,
    /// The types that have been used, by the address of their table.
    types: RwLock<Vec<(usize, UsedType)>>,
}

/// A type with a table.
#[derive(Debug)]
pub(crate) struct UsedType {
    pub layout: Layout,
    pub of: PortType,
}

impl ComponentParts {
    pub fn new(armor: ForeignArmor) -> Self {
        Self {
            armor,
            outputs: RwLock::default(),
            inputs: RwLock::default(),
            types: RwLock::default(),
        }
    }

    /// Uses the type with this table; `read` reads it the first time.
    pub fn with_type<T>(
        &self,
        address: usize,
        read: impl FnOnce() -> Result<Layout, Failure>,
        work: impl FnOnce(&UsedType) -> Result<T, Failure>,
    ) -> Result<T, Failure> {
        let is_it = |(known, _): &&(usize, UsedType)| *known == address;
        // `work` may wait for a subscriber: a thread that waits to add a type must not stop the others.
        if let Some((_, used)) = self.types.read_recursive().iter().find(is_it) {
            return work(used);
        }
        let layout = read()?;
        let of = PortType::of_schema(layout.schema.clone())?;
        let used = UsedType { layout, of };
        let result = work(&used);
        self.types.write().push((address, used));
        result
    }

    pub fn provide(&self, id: &str, of: &PortType, latched: bool) -> Result<(), Failure> {
        self.armor.provide(id, of, latched)?;
        self.outputs.write().push((id.into(), Arc::new(DeclaredPort { of: of.clone() })));
        Ok(())
    }

    pub fn subscribe(
        &self,
        id: &str,
        of: &PortType,
        required: bool,
        many: bool,
    ) -> Result<(), Failure> {
        self.armor.subscribe(id, of, required, many)?;
        self.inputs.write().push((id.into(), Arc::new(DeclaredPort { of: of.clone() })));
        Ok(())
    }

    /// Checks the type of an output. One that does not exist is left to `send_data`, which explains it.
    pub fn check_output(&self, id: &str, of: &PortType) -> Result<(), Failure> {
        match self.outputs.read().iter().find(|(output, _)| output == id) {
            Some((_, port)) => check_type("output", id, port, of),
            None => Ok(()),
        }
    }

    pub fn find_input(&self, id: &str) -> Option<Arc<DeclaredPort>> {
        let inputs = self.inputs.read();
        inputs.iter().find(|(input, _)| input == id).map(|(_, port)| Arc::clone(port))
    }

    /// Checks the type of an input.
    pub fn check_input(&self, id: &str, of: &PortType) -> Result<(), Failure> {
        match self.inputs.read().iter().find(|(input, _)| input == id) {
            Some((_, port)) => check_type("input", id, port, of),
            None => Ok(()),
        }
    }
}

/// Checks that a port is used with the type it was declared with.
pub(crate) fn check_type(
    noun: &str,
    id: &str,
    port: &DeclaredPort,
    of: &PortType,
) -> Result<(), Failure> {
    if port.of.text() == of.text() {
        return Ok(());
    }
    let (declared, used) = (port.of.name(), of.name());
    let why = if declared == used {
        let difference = schema::difference(("declared", port.of.text()), ("used", of.text()));
        format!("{noun} `{id}` is declared as {declared} with other fields: {difference}")
    } else {
        format!("{noun} `{id}` is declared as {declared}, but used as {used}")
    };
    Err(Failure::new(ArmorError::OtherType, why))
}

/// A component whose functions are C's.
pub(crate) struct CComponent {
    functions: CFunctions,
    handle: Arc<ArmorHandle>,
    /// Names of inputs, data and parameters, as C reads them.
    names: Vec<(String, CString)>,
}

impl CComponent {
    /// Lets C declare its ports.
    pub fn create(functions: CFunctions, handle: Arc<ArmorHandle>) -> Result<Self, Fault> {
        let create = functions.create().ok_or_else(|| Failure::null("create"))?;
        let created = check_returned(|| create(Arc::as_ptr(&handle), functions.user()));
        flush_printed();
        created?;
        Ok(Self { functions, handle, names: Vec::new() })
    }

    /// A name as C reads it; valid as long as the component.
    fn name(names: &mut Vec<(String, CString)>, name: &str) -> *const c_char {
        let place = match names.iter().position(|(known, _)| known == name) {
            Some(place) => place,
            None => {
                names.push((name.into(), to_c_text(name)));
                names.len() - 1
            }
        };
        names[place].1.as_ptr()
    }
}

/// Calls a function of C, and returns its failure.
fn check_returned(function: impl FnOnce() -> c_int) -> Result<(), Fault> {
    clear_last_error();
    match function() {
        0 => Ok(()),
        code => Err(explain_failure(code).into()),
    }
}

fn clear_last_error() {
    if with_last_error(|last| !last.is_empty()) {
        keep_last_error("");
    }
}

/// The failure that C has returned: the text that it, or a function that it has called, has left.
fn explain_failure(code: c_int) -> String {
    let text = with_last_error(|last| last.to_string_lossy().into_owned());
    match text.is_empty() {
        true => ArmorError::of_code(code).text().to_string_lossy().into_owned(),
        false => text,
    }
}

impl ForeignComponent for CComponent {
    fn parameter_received(&mut self, name: &str, value: &Value) -> Result<(), Fault> {
        let Some(function) = self.functions.parameter_received() else {
            let why = format!(
                "the value of `{name}` has arrived, but the component has no `parameter_received`; \
                 give one, or do not request `{name}`"
            );
            return Err(why.into());
        };
        let name = Self::name(&mut self.names, name);
        let value = ArmorValue::new(value);
        check_returned(|| function(self.functions.user(), name, &raw const value))
    }

    fn data_received(&mut self, header: &Header<'_>, data: &Data<'_>) -> Result<(), Fault> {
        let Some(function) = self.functions.data_received() else { return Ok(()) };
        let c_header = ArmorHeader {
            id: Self::name(&mut self.names, header.id()),
            data: Self::name(&mut self.names, header.data()),
            sequence: header.sequence,
            stamp_s: header.stamp_s,
            instance: header.instance,
            lost: header.lost,
        };
        let c_data = ArmorData::new(&self.handle, header, data);
        check_returned(|| function(self.functions.user(), &raw const c_header, &raw const c_data))
    }

    fn exec(&mut self, call: Call) -> Result<Outcome, Fault> {
        let Some(function) = self.functions.exec() else { return Ok(Outcome::CarryOn) };
        clear_last_error();
        let call = match call {
            Call::Started => ArmorCall::Started,
            Call::Tick => ArmorCall::Tick,
            Call::Data => ArmorCall::Data,
            Call::Stopping => ArmorCall::Stopping,
        };
        let outcome = function(self.functions.user(), call as c_int);
        let explain = || explain_failure(ArmorError::Failed as c_int);
        Ok(read_outcome(&outcome, explain)?)
    }
}
