//! The mission file: read with positions, checked as a whole, described by a typed model.
//!
//! [`load`] reads a file and the files that it names; [`check`] checks them as a whole; the rest of
//! the system runs a [`Configuration`] without errors. The stages: bytes → [`tree`] (quick-xml's
//! events, with limits) → [`model`] and [`mission`] → findings, each with its place and remedy.
//!
//! ```
//! use armor_robotfile::{check, read};
//!
//! let file = br#"<armor version="1"><system><component name="sim" kind="simulator"/></system></armor>"#;
//! let reading = read("a.xml".as_ref(), &mut |_| Ok(file.to_vec()));
//! let reading = check(reading, &[], None);
//! assert!(reading.is_valid());
//! assert_eq!(reading.configuration.unwrap().system.components[0].kind.value, "simulator");
//! ```

mod check;
pub mod claim;
mod code;
mod date;
mod difference;
pub mod drawn_route;

mod edit;
mod elements;
mod fields;
mod finding;
mod findings;
mod flatten;
mod format;
pub mod guard;
mod load;
mod manifests;
pub mod mission;
pub mod model;
mod namespaces;

mod offered_edit;
mod overrides;
mod page;
mod proven;
mod read;
mod recover;
mod render;
pub mod resources;
mod route;
pub mod site_map;
mod source;
mod start_tag;
mod suggestion;
mod time_words;
pub mod timing;
mod trace;
pub mod tree;
mod typed_manifests;
mod unreadable;
mod wanted_quantity;
mod xml;

pub use check::{
    BASE_FRAME, MOVING_FRAMES, NeededPath, RESERVED_NAMES, check, check_times, fill_parameters,
    needed_paths, passed_dates, within,
};
pub use code::{Code, CodeSection, FindingOrigin};
pub use date::{Date, format_date};
pub use difference::{Change, Difference, Subject, differences};
pub use edit::{Derivation, Document, EditError, ElementEdit, Item, NewElement, Position};
pub use finding::{Finding, Severity};
pub use findings::{Findings, MAX_FINDINGS};
pub use flatten::{list_scopes, submission_prefix};
pub use format::format;
pub use load::{Reading, load, load_copy, read, read_bytes, suggest_file};
pub use manifests::Manifests;
pub use mission::Mission;
pub use model::{Configuration, System};
pub use offered_edit::OfferedEdit;
pub use overrides::Override;
pub use page::PageExample;
pub use read::{
    MAX_ELEMENTS, MAX_FRAMES, MAX_LINKS, MAX_MAP_CORNERS, MAX_RALLIES, MAX_ROUTE_STEPS, MAX_ROUTES,
    MAX_SHAPE_CORNERS, MAX_ZONES,
};
pub use render::Colours;
pub use route::{DrivePurpose, RouteDrive, list_drives};
pub use source::{Location, Source, Span, Spanned};
pub use suggestion::{advise_similar, suggest_similar};
pub use time_words::time_in_words;
pub use trace::{FiringTrace, MissionDuration};
pub use typed_manifests::TypedManifests;
pub use xml::{MAX_ATTRIBUTES, MAX_DEPTH, MAX_FILE_BYTES, MAX_PIECES, parse_tree};

/// The schema of the format, for other XML tools.
pub const SCHEMA: &str = include_str!("../armor.xsd");
