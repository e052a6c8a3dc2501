//! The message types that are known: those of the running system, and those of all kinds of components.

use std::collections::{BTreeMap, BTreeSet};

use anyhow::{Result, bail};
use armor_robotfile::advise_similar;
use armor_sdk::directory::Listing;
use armor_wire::manifest::PortManifest;
use armor_wire::schema::hash_text;

use crate::arguments::RunningSystem;
use crate::kinds::Catalogue;
use crate::system;

/// Types by name, each with its schemas: usually one.
pub struct MessageTypes {
    schemas: BTreeMap<String, BTreeSet<String>>,
    catalogue: Catalogue,
}

impl MessageTypes {
    /// Gathers the types of what is published now, and of the ports of all kinds that the file of the
    /// system can use.
    ///
    /// # Errors
    /// If a stock component is broken.
    pub fn gather(running: &RunningSystem, listing: &Listing) -> Result<Self> {
        // Without a record, as on another host, only the kinds of this program are known.
        let file = system::find_record(running).ok().map(|record| record.file);
        let catalogue = Catalogue::gather(&[], file.as_deref())?;
        let mut types = Self { schemas: BTreeMap::new(), catalogue };
        let published = listing.data.iter().map(|entry| (&entry.type_name, &entry.schema));
        for (name, schema) in published.filter(|(_, schema)| !schema.is_empty()) {
            types.schemas.entry(name.clone()).or_default().insert(schema.clone());
        }
        for kind in types.catalogue.kinds.values() {
            let ports = kind.manifest.inputs.iter().chain(&kind.manifest.outputs);
            for port in ports.filter(|port| !port.is_any()) {
                let schemas = types.schemas.entry(port.type_name.clone()).or_default();
                schemas.insert(port.schema.clone());
            }
        }
        Ok(types)
    }

    /// Returns the input of a kind, if the kind is known.
    pub fn find_input(&self, kind: &str, input: &str) -> Option<&PortManifest> {
        self.catalogue.kinds.get(kind)?.manifest.inputs.iter().find(|port| port.id == input)
    }

    /// Returns the schema of a type. Of several with the name, the `preferred` one.
    ///
    /// # Errors
    /// If no type has the name, with the one that was probably meant; or if several have it.
    pub fn find_schema(&self, name: &str, preferred: &BTreeSet<String>) -> Result<&str> {
        let Some(schemas) = self.schemas.get(name) else {
            let known = self.schemas.keys().map(String::as_str);
            let advice = advise_similar(name, known);
            bail!(
                "no type is called {name}{advice}; `armor data list` and `armor describe KIND` show \
                 types"
            );
        };
        let mut chosen: Vec<_> = schemas.iter().filter(|it| preferred.contains(*it)).collect();
        if chosen.is_empty() {
            chosen = schemas.iter().collect();
        }
        match chosen.as_slice() {
            [only] => Ok(only),
            several => {
                let hashes: Vec<_> =
                    several.iter().map(|it| format!("{:016x}", hash_text(it))).collect();
                bail!(
                    "{} types are called {name}, with the hashes {}: stop the components that \
                     publish one of them, or rename it",
                    several.len(),
                    hashes.join(" and ")
                )
            }
        }
    }
}
