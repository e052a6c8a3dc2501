//! Namespaces: Armor's elements have none; prefixed attributes belong to other programs and are
//! ignored, but their prefix must be declared, or other XML tools would refuse the file.

use std::sync::Arc;

use crate::code::Code;
use crate::finding::Finding;
use crate::findings::Findings;
use crate::source::{Location, Source, Span};
use crate::tree::Element;

/// Reports undeclared prefixes and a default namespace.
pub(crate) fn check(root: &Element, source: &Arc<Source>, findings: &mut Findings) {
    let mut declared = vec!["xml".to_owned()];
    visit_elements(root, source, &mut declared, findings);
}

/// Recursion is bounded by the tree's depth.
fn visit_elements(
    element: &Element,
    source: &Arc<Source>,
    declared: &mut Vec<String>,
    findings: &mut Findings,
) {
    let outside = declared.len();
    let mut report = |span: Span, message: String, remedy: &str| {
        let at = Location::new(source, span);
        findings.push(Finding::new(Code::Namespace, &at, message).remedy(remedy));
    };
    for attribute in &element.attributes {
        if attribute.name == "xmlns" {
            let message =
                "a default namespace makes these the elements of another format".to_owned();
            report(attribute.name_span, message, "remove it; Armor's elements have no namespace");
        } else if let Some(prefix) = attribute.name.strip_prefix("xmlns:") {
            if attribute.value.is_empty() || prefix == "xmlns" {
                let message = format!("the prefix {prefix} cannot be declared like this");
                report(attribute.name_span, message, "give it a namespace of your own");
            }
            declared.push(prefix.to_owned());
        }
    }
    let names = std::iter::once((&element.name, element.name_span))
        .chain(element.attributes.iter().map(|attribute| (&attribute.name, attribute.name_span)));
    for (name, span) in names {
        let Some((prefix, local)) = name.split_once(':') else { continue };
        if prefix.is_empty() || local.is_empty() || local.contains(':') {
            report(
                span,
                format!("{name} is not a prefix and a name"),
                "write one colon between them",
            );
        } else if prefix != "xmlns" && !declared.iter().any(|known| known == prefix) {
            let remedy = format!("declare it on <armor>: xmlns:{prefix}=\"…\"");
            report(span, format!("the prefix {prefix} is not declared"), &remedy);
        }
    }
    for child in element.elements() {
        visit_elements(child, source, declared, findings);
    }
    declared.truncate(outside);
}
