//! The parts of a guard of which one is enough for it to be true.

use std::ops::Range;

use crate::guard::node::{Guard, GuardNode, GuardNodeKind, GuardOperator};

impl Guard {
    /// Returns the conditions between which it has an `or`, each as a guard with the same names, and where
    /// in the text it is; those under a `not` are left out.
    pub fn alternatives(&self) -> Vec<(Range<usize>, Self)> {
        let mut found = Vec::new();
        collect(&self.root, false, &mut found);
        let guard = |node: &GuardNode| Self { root: node.clone(), names: self.names.clone() };
        found.into_iter().map(|node| (node.at.clone(), guard(node))).collect()
    }

    /// Returns whether it contains the name with this index in [`Guard::names`].
    pub fn contains(&self, name: usize) -> bool {
        contains(&self.root, name)
    }
}

fn contains(node: &GuardNode, name: usize) -> bool {
    match &node.kind {
        GuardNodeKind::Name(index) | GuardNodeKind::Known(index) => *index == name,
        GuardNodeKind::Not(inner) | GuardNodeKind::Minus(inner) => contains(inner, name),
        GuardNodeKind::Binary(_, left, right) => contains(left, name) || contains(right, name),
        _ => false,
    }
}

fn collect<'a>(node: &'a GuardNode, is_alternative: bool, found: &mut Vec<&'a GuardNode>) {
    match &node.kind {
        GuardNodeKind::Binary(GuardOperator::Or, left, right) => {
            collect(left, true, found);
            collect(right, true, found);
        }
        kind => {
            if is_alternative {
                found.push(node);
            }
            if let GuardNodeKind::Binary(GuardOperator::And, left, right) = kind {
                collect(left, false, found);
                collect(right, false, found);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_side_of_an_or_is_an_alternative() {
        let texts = |text: &str| {
            let alternatives = Guard::parse(text).expect("a guard").alternatives();
            let texts = alternatives.into_iter().map(|(at, _)| text[at].to_owned());
            texts.collect::<Vec<_>>()
        };
        assert!(texts("a and b < 2").is_empty());
        assert_eq!(texts("n == 3 or b <= 40%"), ["n == 3", "b <= 40%"]);
        assert_eq!(texts("c and (n == 3 or a and b)"), ["n == 3", "a and b"]);
        assert_eq!(texts("a or not (b or c)"), ["a", "not (b or c)"]);
    }
}
