//! The layout of a message class: its schema, and how its attributes are read and written.

use armor_sdk::foreign::{KeptMessage, PortType};
use armor_sdk::wire::quantity::{Unit, explain_unknown};
use armor_sdk::wire::schema::{ANY_NAME, Field, Schema, Variant};
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyString, PyTuple, PyType};

use crate::array::NumberType;
use crate::decode::MessageReader;
use crate::encode::EncodedMessage;
use crate::fault::MessageError;

/// How a value lies in the bytes, and what it is in Python.
#[derive(Debug)]
pub enum ValueLayout {
    /// `bool`.
    Flag,
    /// `int` or `float`.
    Number(NumberType),
    /// `str`.
    Text,
    /// Bytes of any count, as `bytes`.
    Bytes,
    /// Numbers of any count, as a numpy array.
    Array(NumberType),
    /// Values of any count, as `list`.
    List(Box<ValueLayout>),
    /// So many values, as `list`.
    Fixed(Box<ValueLayout>, usize),
    /// A value or `None`.
    Optional(Box<ValueLayout>),
    /// Another message.
    Message(Py<Layout>),
}

/// An attribute of a message.
#[derive(Debug)]
pub struct FieldLayout {
    /// Its name in Python.
    pub attribute: Py<PyString>,
    /// Its name in the schema.
    pub name: String,
    /// Its value.
    pub value: ValueLayout,
}

/// What a message consists of.
#[derive(Debug)]
pub enum Parts {
    /// Attributes, in order.
    Fields(Vec<FieldLayout>),
    /// One of these members of an enum.
    Members(Vec<Py<PyAny>>),
    /// Any: the message is passed on as it is.
    Any,
}

/// The layout of a message class, made once for each.
#[pyclass(module = "armor._armor", frozen)]
#[derive(Debug)]
pub struct Layout {
    /// The class.
    pub class: Py<PyType>,
    /// Its schema, with a name.
    pub port_type: PortType,
    /// Its parts.
    pub parts: Parts,
    /// `object.__new__`, which makes an instance without running its constructor, and its argument.
    create: (Py<PyAny>, Py<PyTuple>),
}

/// An attribute, its name in the schema, its unit, and its value as the package describes it.
type DescribedField<'py> = (Bound<'py, PyString>, String, Option<String>, Bound<'py, PyAny>);

#[pymethods]
impl Layout {
    /// `fields`: for each its attribute, its name in the schema, its unit or `None`, and its value.
    #[staticmethod]
    fn of_fields(
        class: &Bound<'_, PyType>,
        name: &str,
        fields: Vec<DescribedField<'_>>,
    ) -> PyResult<Self> {
        let (mut parts, mut declared) = (Vec::new(), Vec::new());
        for (attribute, field, unit, value) in fields {
            let (value, schema) = read_value(&value)?;
            declared.push(Field { name: field.clone(), schema, unit });
            let attribute = PyString::intern(class.py(), &attribute.to_cow()?).unbind();
            parts.push(FieldLayout { attribute, name: field, value });
        }
        let schema = Schema::Struct { name: name.into(), fields: declared };
        Self::new(class, schema, Parts::Fields(parts))
    }

    /// `members`: of the enum, with their names in the schema.
    #[staticmethod]
    fn of_members(
        class: &Bound<'_, PyType>,
        name: &str,
        members: Vec<(String, Py<PyAny>)>,
    ) -> PyResult<Self> {
        let variants = members.iter();
        let variants = variants.map(|(name, _)| Variant { name: name.clone(), fields: Vec::new() });
        let schema = Schema::Enum { name: name.into(), variants: variants.collect() };
        let members = members.into_iter().map(|(_, member)| member).collect();
        Self::new(class, schema, Parts::Members(members))
    }

    /// That of messages of any type, `class` being `armor.AnyMessage`.
    #[staticmethod]
    fn of_any(class: &Bound<'_, PyType>) -> PyResult<Self> {
        Self::new(class, Schema::Struct { name: ANY_NAME.into(), fields: Vec::new() }, Parts::Any)
    }

    /// The schema in its canonical form.
    #[getter]
    fn schema(&self) -> &str {
        self.port_type.text()
    }

    /// The name of the message.
    #[getter]
    fn name(&self) -> &str {
        self.port_type.name()
    }
}

impl Layout {
    /// An instance of the class without the values of its attributes.
    pub fn create_message<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let (create, argument) = &self.create;
        create.bind(py).call1(argument)
    }

    /// Whether `message` is an instance of the class.
    pub fn is_of_class(&self, message: &Bound<'_, PyAny>) -> PyResult<bool> {
        let class = self.class.bind(message.py());
        // Mostly of the class itself, which takes no call of Python.
        Ok(message.get_type_ptr() == class.as_type_ptr() || message.is_instance(class)?)
    }

    /// Whether it is that of messages of any type.
    pub fn is_any(&self) -> bool {
        matches!(self.parts, Parts::Any)
    }

    fn new(class: &Bound<'_, PyType>, schema: Schema, parts: Parts) -> PyResult<Self> {
        // Once as text and back: limits and names are checked as for a message of any other process.
        let port_type = PortType::parse(&schema.to_string()).map_err(|error| {
            MessageError::new_err(format!("`{class}` cannot be a message: {error}"))
        })?;
        let py = class.py();
        let create = py.import("builtins")?.getattr("object")?.getattr("__new__")?.unbind();
        let argument = PyTuple::new(py, [class])?.unbind();
        Ok(Self { class: class.clone().unbind(), port_type, parts, create: (create, argument) })
    }
}

/// Reads how a value is described: the name of a primitive, a layout, or a tuple of a word and values.
fn read_value(described: &Bound<'_, PyAny>) -> PyResult<(ValueLayout, Schema)> {
    if let Ok(layout) = described.cast::<Layout>() {
        let schema = (**layout.get().port_type.schema()).clone();
        return Ok((ValueLayout::Message(layout.clone().unbind()), schema));
    }
    if let Ok(name) = described.cast::<PyString>() {
        return read_primitive(&name.to_cow()?);
    }
    let parts = described.cast::<PyTuple>()?;
    let word: String = parts.get_item(0)?.extract()?;
    let (item, schema) = read_value(&parts.get_item(1)?)?;
    let list = |schema: Schema| Schema::List(Box::new(schema));
    Ok(match (word.as_str(), item) {
        ("bytes", ValueLayout::Number(_)) => (ValueLayout::Bytes, list(schema)),
        ("array", ValueLayout::Number(number)) => (ValueLayout::Array(number), list(schema)),
        ("list", item) => (ValueLayout::List(Box::new(item)), list(schema)),
        ("optional", item) => {
            (ValueLayout::Optional(Box::new(item)), Schema::Option(Box::new(schema)))
        }
        ("fixed", item) => {
            let count: usize = parts.get_item(2)?.extract()?;
            let layout = ValueLayout::Fixed(Box::new(item), count);
            (layout, Schema::Fixed(Box::new(schema), count))
        }
        (word, _) => {
            return Err(MessageError::new_err(format!("no value is described by `{word}`")));
        }
    })
}

fn read_primitive(name: &str) -> PyResult<(ValueLayout, Schema)> {
    let schema = armor_sdk::wire::schema::parse(name);
    let schema = schema.map_err(|error| MessageError::new_err(format!("`{name}`: {error}")))?;
    let layout = match &schema {
        Schema::Bool => ValueLayout::Flag,
        Schema::Text => ValueLayout::Text,
        other => NumberType::of_schema(other)
            .map(ValueLayout::Number)
            .ok_or_else(|| MessageError::new_err(format!("`{name}` is not a primitive")))?,
    };
    Ok((layout, schema))
}

/// The name of a unit as schemas have it.
#[pyfunction]
pub fn check_unit(name: &str) -> PyResult<&'static str> {
    let unit = Unit::named(name).ok_or_else(|| {
        MessageError::new_err(format!("there is no unit `{name}`; {}", explain_unknown(name)))
    })?;
    Ok(unit.ascii_name())
}

/// The bytes of a message.
#[pyfunction]
pub fn encode<'py>(
    layout: &Bound<'py, Layout>,
    message: &Bound<'py, PyAny>,
) -> PyResult<Bound<'py, PyBytes>> {
    let encoded = EncodedMessage::of(layout.get(), message)?;
    Ok(PyBytes::new(message.py(), &encoded.pieces().concat()))
}

/// The message that has these bytes.
#[pyfunction]
pub fn decode<'py>(
    layout: &Bound<'py, Layout>,
    bytes: &Bound<'py, PyBytes>,
) -> PyResult<Bound<'py, PyAny>> {
    let bytes = bytes.as_bytes();
    let keep = || KeptMessage::copy_of(bytes);
    MessageReader::new(layout.py(), bytes, &keep).read_all(layout.get())
}
