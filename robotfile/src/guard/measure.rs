//! The quantities of the numbers in a guard, and those of their products.

use armor_wire::quantity::Dimension;

/// The quantity of a number.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Measure {
    Any,
    /// Nothing: it has no unit.
    Bare,
    /// Something physical; `unit` is that of its field where it is not the SI one.
    Of {
        dimension: Dimension,
        unit: Option<&'static str>,
    },
    /// A unit that is not known here.
    Other(String),
}

pub(super) fn times(left: &Measure, right: &Measure) -> Measure {
    match (left, right) {
        (one, other) | (other, one) if is_pure(one) => other.clone(),
        _ => Measure::Any,
    }
}

pub(super) fn by(left: &Measure, right: &Measure) -> Measure {
    match (left, right) {
        (one, other) if is_pure(other) => one.clone(),
        (Measure::Of { dimension, .. }, Measure::Of { dimension: other, .. })
            if dimension == other =>
        {
            Measure::Bare
        }
        _ => Measure::Any,
    }
}

/// A factor that changes no unit.
fn is_pure(measure: &Measure) -> bool {
    matches!(measure, Measure::Bare | Measure::Of { dimension: Dimension::Ratio, .. })
}

pub(super) fn in_words(measure: &Measure) -> String {
    match measure {
        Measure::Any => "a number".into(),
        Measure::Bare => "a number without unit".into(),
        Measure::Other(unit) => format!("in {unit}"),
        Measure::Of { dimension, .. } => dimension_noun(*dimension),
    }
}

/// Returns the quantity with its article.
pub(crate) fn dimension_noun(dimension: Dimension) -> String {
    let label = dimension.label();
    let article = if label.starts_with(['a', 'e', 'i', 'o', 'u']) { "an" } else { "a" };
    format!("{article} {label}")
}
