//! A component of C as the SDK calls it.

use std::ffi::{CStr, CString, c_char, c_int};
use std::sync::{Arc, OnceLock};

use armor_sdk::foreign::{ForeignArmor, ForeignComponent, PortType};
use armor_sdk::wire::schema;
use armor_sdk::{Call, Data, Fault, Header, Outcome, Value};
use parking_lot::RwLock;

use crate::boundary::{
    ArmorData, ArmorHandle, ArmorValue, CFunctions, check_utf8, flush_printed, read_outcome,
};
use crate::declaration::{ArmorCall, ArmorHeader};
use crate::failure::{ArmorError, Failure, clear_last_error, to_c_text, with_last_error};
use crate::layout::Layout;

/// A port, as C has declared it.
#[derive(Debug)]
pub(crate) struct DeclaredPort {
    of: PortType,
    /// The type with a table that it was declared with; `None` if with a schema.
    used: Option<Arc<UsedType>>,
}

impl DeclaredPort {
    pub fn of_schema(of: PortType) -> Self {
        Self { of, used: None }
    }

    pub fn of_table(used: &Arc<UsedType>) -> Self {
        Self { of: used.of.clone(), used: Some(Arc::clone(used)) }
    }
}

/// A port with its name.
type NamedPort = (String, Arc<DeclaredPort>);

/// Searched for each message: a few short lists are faster than maps.
#[derive(Clone, Default)]
struct DeclaredPorts {
    outputs: Vec<NamedPort>,
    inputs: Vec<NamedPort>,
}

/// What the functions of C need of a component; its threads share it.
pub(crate) struct ComponentParts {
    pub armor: ForeignArmor,
    /// The ports, while `create` declares them.
    declaring: RwLock<DeclaredPorts>,
    /// The ports when `create` has returned. No message waits for a lock then.
    declared: OnceLock<DeclaredPorts>,
    /// The types that have been used.
    types: RwLock<Vec<Arc<UsedType>>>,
}

/// A type with a table.
#[derive(Debug)]
pub(crate) struct UsedType {
    /// Address of its table.
    table: usize,
    pub layout: Layout,
    pub of: PortType,
}

impl ComponentParts {
    pub fn new(armor: ForeignArmor) -> Self {
        Self {
            armor,
            declaring: RwLock::default(),
            declared: OnceLock::new(),
            types: RwLock::default(),
        }
    }

    /// Uses the type with the table at this address; `read` reads it the first time.
    pub fn with_type<T>(
        &self,
        table: usize,
        read: impl FnOnce() -> Result<Layout, Failure>,
        work: impl FnOnce(&Arc<UsedType>) -> Result<T, Failure>,
    ) -> Result<T, Failure> {
        // `work` may wait for a subscriber: a thread that waits to add a type must not stop the others.
        if let Some(used) = self.types.read_recursive().iter().find(|used| used.table == table) {
            return work(used);
        }
        let layout = read()?;
        let of = PortType::of_schema(layout.schema.clone())?;
        let used = Arc::new(UsedType { table, layout, of });
        let result = work(&used);
        self.types.write().push(used);
        result
    }

    /// As [`with_type`](Self::with_type), for a message that is to be sent on this output. An output that
    /// does not exist is left to `send_data`, which explains it.
    pub fn with_output_type<T>(
        &self,
        id: &CStr,
        table: usize,
        read: impl FnOnce() -> Result<Layout, Failure>,
        work: impl FnOnce(&str, &UsedType) -> Result<T, Failure>,
    ) -> Result<T, Failure> {
        if let Some((id, port)) = self.find_output(id)
            && let Some(used) = port.used.as_deref().filter(|used| used.table == table)
        {
            return work(id, used);
        }
        let id = check_utf8(id, "id")?;
        self.with_type(table, read, |used| {
            self.with_ports(|ports| check_port("output", &ports.outputs, id, &used.of))?;
            work(id, used)
        })
    }

    /// The name of an output that a message is to be sent on, also of one that does not exist.
    pub fn read_output_id<'a>(&'a self, id: &'a CStr) -> Result<&'a str, Failure> {
        match self.find_output(id) {
            Some((id, _)) => Ok(id),
            None => check_utf8(id, "id"),
        }
    }

    /// The output of this name, after `create`. The name of a port is UTF-8, so one that equals it is.
    fn find_output(&self, id: &CStr) -> Option<&NamedPort> {
        let outputs = &self.declared.get()?.outputs;
        outputs.iter().find(|(port, _)| port.as_bytes() == id.to_bytes())
    }

    /// As [`with_type`](Self::with_type), for a message that has arrived at this input.
    pub fn with_input_type<T>(
        &self,
        id: &str,
        table: usize,
        read: impl FnOnce() -> Result<Layout, Failure>,
        work: impl FnOnce(&UsedType) -> Result<T, Failure>,
    ) -> Result<T, Failure> {
        let ports = self.declared.get();
        if let Some(used) = ports.and_then(|ports| find_declared_type(&ports.inputs, id, table)) {
            return work(used);
        }
        self.with_type(table, read, |used| {
            self.with_ports(|ports| check_port("input", &ports.inputs, id, &used.of))?;
            work(used)
        })
    }

    pub fn provide(&self, id: &str, port: DeclaredPort, latched: bool) -> Result<(), Failure> {
        self.armor.provide(id, &port.of, latched)?;
        self.declaring.write().outputs.push((id.into(), Arc::new(port)));
        Ok(())
    }

    pub fn subscribe(
        &self,
        id: &str,
        port: DeclaredPort,
        required: bool,
        many: bool,
    ) -> Result<(), Failure> {
        self.armor.subscribe(id, &port.of, required, many)?;
        self.declaring.write().inputs.push((id.into(), Arc::new(port)));
        Ok(())
    }

    /// No port is declared any more.
    fn end_declaration(&self) {
        let declared = self.declaring.read().clone();
        self.declared.get_or_init(|| declared);
    }

    fn with_ports<T>(&self, work: impl FnOnce(&DeclaredPorts) -> T) -> T {
        match self.declared.get() {
            Some(ports) => work(ports),
            None => work(&self.declaring.read()),
        }
    }

    pub fn find_input(&self, id: &str) -> Option<Arc<DeclaredPort>> {
        self.with_ports(|ports| find_port(&ports.inputs, id).map(Arc::clone))
    }
}

fn find_port<'a>(ports: &'a [NamedPort], id: &str) -> Option<&'a Arc<DeclaredPort>> {
    ports.iter().find(|(port, _)| port == id).map(|(_, port)| port)
}

/// The type of a port, if it was declared with this table.
fn find_declared_type<'a>(ports: &'a [NamedPort], id: &str, table: usize) -> Option<&'a UsedType> {
    find_port(ports, id)?.used.as_deref().filter(|used| used.table == table)
}

/// Checks the type of a port, if it exists.
fn check_port(noun: &str, ports: &[NamedPort], id: &str, of: &PortType) -> Result<(), Failure> {
    find_port(ports, id).map_or(Ok(()), |port| check_type(noun, id, port, of))
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
    inputs: CNames,
    data: CNames,
    parameters: CNames,
}

/// Names as C reads them.
#[derive(Default)]
struct CNames {
    known: Vec<(String, CString)>,
    /// The place of the last one: most messages follow one of the same link.
    last: usize,
}

impl CNames {
    /// A name, valid as long as the component.
    fn lend(&mut self, name: &str) -> *const c_char {
        let is_name = |(known, _): &(String, CString)| known == name;
        if !self.known.get(self.last).is_some_and(is_name) {
            self.last = self.known.iter().position(is_name).unwrap_or_else(|| {
                self.known.push((name.into(), to_c_text(name)));
                self.known.len() - 1
            });
        }
        self.known[self.last].1.as_ptr()
    }
}

impl CComponent {
    /// Lets C declare its ports.
    pub fn create(functions: CFunctions, handle: Arc<ArmorHandle>) -> Result<Self, Fault> {
        let create = functions.create().ok_or_else(|| Failure::null("create"))?;
        let created = check_returned(|| create(Arc::as_ptr(&handle), functions.user()));
        flush_printed();
        created?;
        handle.0.end_declaration();
        let (inputs, data, parameters) = Default::default();
        Ok(Self { functions, handle, inputs, data, parameters })
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
        let name = self.parameters.lend(name);
        let value = ArmorValue::new(value);
        check_returned(|| function(self.functions.user(), name, &raw const value))
    }

    fn data_received(&mut self, header: &Header<'_>, data: &Data<'_>) -> Result<(), Fault> {
        let Some(function) = self.functions.data_received() else { return Ok(()) };
        let c_header = ArmorHeader {
            id: self.inputs.lend(header.id()),
            data: self.data.lend(header.data()),
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
