//! Prints a guard: one spelling for all guards that are equal, with no unnecessary parentheses.

use std::fmt::{self, Write};

use crate::guard::node::{Guard, GuardNode, GuardNodeKind, GuardOperator};

const NOT: u8 = 3;
const SIGN: u8 = 7;

impl fmt::Display for Guard {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.write_node(&self.root, 0, f)
    }
}

/// The text: places in a file do not count.
impl fmt::Debug for Guard {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "Guard({self})")
    }
}

impl Guard {
    /// Writes a node that must bind as tightly as `rank`.
    fn write_node(&self, node: &GuardNode, rank: u8, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let own = match &node.kind {
            GuardNodeKind::Binary(operator, ..) => operator.rank(),
            GuardNodeKind::Not(_) => NOT,
            GuardNodeKind::Minus(_) => SIGN,
            _ => u8::MAX,
        };
        if own < rank {
            f.write_char('(')?;
            self.write_node(node, 0, f)?;
            return f.write_char(')');
        }
        match &node.kind {
            GuardNodeKind::Number(value, unit) => {
                write_number(*value, f)?;
                f.write_str(unit.map_or("", |unit| unit.name))
            }
            GuardNodeKind::Truth(truth) => write!(f, "{truth}"),
            GuardNodeKind::Text(text) => write!(f, "'{text}'"),
            GuardNodeKind::Name(index) => f.write_str(self.names[*index].as_str()),
            GuardNodeKind::Known(index) => write!(f, "known({})", self.names[*index]),
            GuardNodeKind::Not(inner) => {
                f.write_str("not ")?;
                self.write_node(inner, NOT, f)
            }
            GuardNodeKind::Minus(inner) => {
                f.write_char('-')?;
                self.write_node(inner, SIGN, f)
            }
            GuardNodeKind::Binary(operator, left, right) => {
                // Comparisons cannot be chained; all other operators associate to the left.
                self.write_node(left, own + u8::from(operator.is_comparison()), f)?;
                write!(f, " {} ", operator.as_str())?;
                self.write_node(right, own + 1, f)
            }
        }
    }
}

/// The shortest that reads back as the same number.
fn write_number(value: f64, f: &mut fmt::Formatter<'_>) -> fmt::Result {
    if value == 0.0 || (1e-4..1e15).contains(&value) {
        write!(f, "{value}")
    } else {
        write!(f, "{value:e}")
    }
}

impl fmt::Display for GuardOperator {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.as_str())
    }
}
