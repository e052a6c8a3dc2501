//! `--set component.parameter=value`: values given on the command line, over those of the file.
//! They are separate from the file, so they apply to each version of it.

use std::path::{Path, PathBuf};

use armor_wire::name::split_data;

use crate::code::Code;
use crate::finding::Finding;
use crate::findings::Findings;
use crate::model::{Configuration, Parameter};
use crate::source::{Location, Source, Span, Spanned};
use crate::suggestion::suggest_similar;

/// The file name in locations of values from the command line.
pub(crate) const OVERRIDE: &str = "--set";

/// One `--set`.
#[derive(Clone, Debug)]
pub struct Override {
    /// The component.
    pub component: Spanned<String>,
    /// The parameter.
    pub name: Spanned<String>,
    /// Its value.
    pub value: Spanned<String>,
    /// The folder that a relative path in the value starts from.
    pub folder: PathBuf,
}

impl Override {
    /// Reads `component.parameter=value`, given in `folder`.
    ///
    /// # Errors
    /// A finding if it is not of that form.
    pub fn parse(text: &str, folder: &Path) -> Result<Self, Box<Finding>> {
        let source = Source::new(OVERRIDE, text);
        let spanned = |start: usize, end: usize| {
            let at = Location::new(&source, Span::new(start, end));
            Spanned::new(text[start..end].to_owned(), at)
        };
        let equals = text.find('=').filter(|equals| split_data(&text[..*equals]).is_some());
        let dot = text.find('.');
        let (Some(equals), Some(dot)) = (equals, dot) else {
            let at = Location::new(&source, Span::new(0, text.len()));
            let finding =
                Finding::new(Code::BadOverride, &at, format!("`{text}` sets no parameter"));
            return Err(Box::new(finding.remedy("write --set component.parameter=value")));
        };
        Ok(Self {
            component: spanned(0, dot),
            name: spanned(dot + 1, equals),
            value: spanned(equals + 1, text.len()),
            folder: folder.to_path_buf(),
        })
    }
}

/// Applies the overrides to the parameters of the system; of several for one parameter, the last
/// one applies. They also have priority over the values of places.
pub fn apply(configuration: &mut Configuration, overrides: &[Override], findings: &mut Findings) {
    for over in overrides {
        let components = &mut configuration.system.components;
        let names: Vec<_> =
            components.iter().map(|component| component.name.value.clone()).collect();
        let found =
            components.iter_mut().find(|component| component.name.value == over.component.value);
        let Some(component) = found else {
            let message = format!("no component is called {}", over.component.value);
            let guess = suggest_similar(&over.component.value, names.iter().map(String::as_str));
            let finding = Finding::new(Code::UnknownComponent, &over.component.at, message);
            findings.push(
                finding.remedy(guess.unwrap_or_else(|| format!("there are {}", names.join(", ")))),
            );
            continue;
        };
        let parameter = Parameter {
            name: over.name.clone(),
            value: over.value.clone(),
            folder: over.folder.clone(),
        };
        component.parameters.retain(|other| other.name.value != over.name.value);
        component.parameters.push(parameter);
        let missions = configuration.mission.iter_mut().chain(configuration.included.values_mut());
        for place in missions.flat_map(|mission| &mut mission.places) {
            place.parameters.retain(|given| {
                given.component.value != over.component.value
                    || given.parameter.name.value != over.name.value
            });
        }
    }
}
