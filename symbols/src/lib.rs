//! Military map symbols after APP-6(D) and MIL-STD-2525D: a code of 20 digits or 15 letters becomes
//! shapes with roles of colour, and SVG. Pure: no files, no clock, nothing of the workspace.
//!
//! ```
//! let symbol = armor_symbols::Symbol::parse("10031000141211000000")?;
//! assert_eq!(symbol.name(), "Infantry");
//! assert!(symbol.findings().is_empty());
//! assert!(symbol.to_svg().starts_with("<svg"));
//! # Ok::<(), armor_symbols::CodeError>(())
//! ```

mod amplifiers;
mod code;
mod control;
mod drawing;
mod frame;
mod icons;
mod letters;
mod measure_geometry;
mod outline;
mod stroke_text;
mod svg;
mod symbol;

pub use code::{
    CodeError, Headquarters, StandardIdentity, SymbolCode, SymbolContext, SymbolSet, SymbolStatus,
};
pub use control::{ControlMeasure, MeasureError, MeasureGeometry};
pub use icons::Icon;
pub use outline::{PaintRole, PathStep, Position, ShapeLine, SymbolShape};
pub use svg::svg_of;
pub use symbol::{Symbol, SymbolFinding};

/// The diameter of the standard's octagon, in the units of all shapes of a symbol. The octagon's
/// centre is the origin; y points down.
pub const OCTAGON: f64 = 240.0;
