//! `include/armor_messages.h` and `.hpp` are the standard messages of armor-sdk. `ARMOR_BLESS=1` writes
//! them.

use std::collections::BTreeMap;
use std::fmt::Write;
use std::path::{Path, PathBuf};

use armor_sdk::wire::schema::{self, Field, Schema, Variant};

const HINT: &str = "do not edit: ARMOR_BLESS=1 cargo test -p armor-c --test messages";
/// Defaults that are not zero.
const DEFAULTS: [(&str, &str, &str); 2] =
    [("Quaternion", "w", "1.0"), ("Progress", "fraction", "std::nanf(\"\")")];

fn crate_file(path: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join(path)
}

/// The schemas that armor-sdk promises, each after those that it contains.
fn standard_schemas() -> Vec<Schema> {
    let text = std::fs::read_to_string(crate_file("../tests/sdk/standard_messages.txt"));
    let text = text.expect("armor-sdk lists its messages");
    text.lines().map(|line| schema::parse(line).expect("a schema")).collect()
}

/// The documentation of the messages: of `Name`, and of its fields and variants, `Name.field`.
fn read_docs() -> BTreeMap<String, Vec<String>> {
    let mut docs = BTreeMap::new();
    for entry in std::fs::read_dir(crate_file("../src/messages")).expect("the messages") {
        let text = std::fs::read_to_string(entry.expect("a file").path()).expect("it is text");
        let (mut lines, mut of) = (Vec::new(), String::new());
        for line in text.lines() {
            let trimmed = line.trim_start();
            if let Some(doc) = trimmed.strip_prefix("///") {
                lines.push(doc.trim().to_owned());
                continue;
            }
            if trimmed.starts_with("#[") {
                continue;
            }
            let word = |text: &str| {
                text.split(|c: char| !c.is_alphanumeric() && c != '_').next().map(str::to_owned)
            };
            let declared =
                ["pub struct ", "pub enum "].iter().find_map(|start| line.strip_prefix(start));
            let member =
                line.strip_prefix("    ").map(|text| text.strip_prefix("pub ").unwrap_or(text));
            if let Some(name) = declared.and_then(word) {
                of.clone_from(&name);
                docs.insert(name, std::mem::take(&mut lines));
            } else if let Some(name) = member.and_then(word).filter(|name| !name.is_empty()) {
                docs.entry(format!("{of}.{name}")).or_insert(std::mem::take(&mut lines));
            } else {
                lines.clear();
                if line.starts_with('}') {
                    of.clear();
                }
            }
        }
    }
    docs
}

/// Writes a documentation as comments.
fn write_doc(out: &mut String, docs: &BTreeMap<String, Vec<String>>, of: &str, indent: &str) {
    for line in docs.get(of).unwrap_or_else(|| panic!("{of} has no documentation")) {
        // Links of Rust lead nowhere here.
        let line = line.replace("[`", "`").replace("`]", "`");
        writeln!(out, "{indent}// {line}").expect("a text");
    }
}

fn name_of(schema: &Schema) -> &str {
    match schema {
        Schema::Struct { name, .. } | Schema::Enum { name, .. } => name,
        other => panic!("{other} has no name"),
    }
}

/// `LaserScan` is `armor_laser_scan`, `NoFix` in it `ARMOR_…_NO_FIX`.
fn snake(name: &str) -> String {
    let mut result = String::new();
    for (index, c) in name.char_indices() {
        let follows_small = index > 0 && name[..index].ends_with(|c: char| c.is_ascii_lowercase());
        if c.is_ascii_uppercase() && follows_small {
            result.push('_');
        }
        result.push(c.to_ascii_lowercase());
    }
    result
}

/// The C type, and its short name in those of lists, of a number or a flag.
fn plain(schema: &Schema) -> Option<(&'static str, &'static str)> {
    Some(match schema {
        Schema::Bool => ("bool", "bool"),
        Schema::U8 => ("uint8_t", "u8"),
        Schema::I8 => ("int8_t", "i8"),
        Schema::U16 => ("uint16_t", "u16"),
        Schema::I16 => ("int16_t", "i16"),
        Schema::U32 => ("uint32_t", "u32"),
        Schema::I32 => ("int32_t", "i32"),
        Schema::U64 => ("uint64_t", "u64"),
        Schema::I64 => ("int64_t", "i64"),
        Schema::F32 => ("float", "f32"),
        Schema::F64 => ("double", "f64"),
        _ => return None,
    })
}

/// A field of C: its declaration, and its entry in the table.
fn c_field(of: &str, field: &Field) -> (String, String) {
    let name = &field.name;
    let unit = field.unit.as_deref().unwrap_or_default();
    let nested = |schema: &Schema| format!("armor_{}", snake(name_of(schema)));
    match &field.schema {
        Schema::Text => {
            (format!("armor_string {name}"), format!("ARMOR_FIELD({of}, {name}, \"{unit}\")"))
        }
        Schema::Fixed(item, count) => {
            let (ctype, _) = plain(item).expect("an array of numbers");
            let entry = format!("ARMOR_ARRAY({of}, {name}, \"{unit}\")");
            (format!("{ctype} {name}[{count}]"), entry)
        }
        Schema::List(item) => match plain(item) {
            Some((_, short)) => {
                let entry = format!("ARMOR_LIST({of}, {name}, \"{unit}\")");
                (format!("armor_{short}_list {name}"), entry)
            }
            None => {
                let item = nested(item);
                let entry = format!("ARMOR_NESTED_LIST({of}, {name}, {item})");
                (format!("ARMOR_LIST_OF({item}) {name}"), entry)
            }
        },
        other => match plain(other) {
            Some((ctype, _)) => {
                (format!("{ctype} {name}"), format!("ARMOR_FIELD({of}, {name}, \"{unit}\")"))
            }
            None => {
                let nested = nested(other);
                let entry = format!("ARMOR_NESTED({of}, {name}, {nested}, \"{unit}\")");
                (format!("{nested} {name}"), entry)
            }
        },
    }
}

fn generate_c() -> String {
    let docs = read_docs();
    let mut out = format!(
        "// The standard messages, with the names and fields of armor-sdk; units and axes by REP-103.\n\
         // Generated from sdk/src/messages; {HINT}\n\n\
         #ifndef ARMOR_MESSAGES_H\n#define ARMOR_MESSAGES_H\n\n#include \"armor.h\"\n\n\
         #ifdef __cplusplus\n#error \"C++ includes armor_messages.hpp\"\n#endif\n"
    );
    for message in standard_schemas() {
        let name = name_of(&message).to_owned();
        let ctype = format!("armor_{}", snake(&name));
        out.push('\n');
        write_doc(&mut out, &docs, &name, "");
        match &message {
            Schema::Enum { variants, .. } => {
                writeln!(out, "typedef enum {ctype} {{").expect("a text");
                for Variant { name: variant, .. } in variants {
                    write_doc(&mut out, &docs, &format!("{name}.{variant}"), "  ");
                    let constant = format!("{ctype}_{}", snake(variant)).to_uppercase();
                    writeln!(out, "  {constant},").expect("a text");
                }
                let names: Vec<_> =
                    variants.iter().map(|one| format!("\"{}\"", one.name)).collect();
                writeln!(
                    out,
                    "}} {ctype};\nARMOR_ENUM({ctype}, \"{name}\", {});",
                    names.join(", ")
                )
                .expect("a text");
            }
            Schema::Struct { fields, .. } => {
                writeln!(out, "typedef struct {ctype} {{").expect("a text");
                let mut entries = Vec::new();
                for field in fields {
                    write_doc(&mut out, &docs, &format!("{name}.{}", field.name), "  ");
                    let (declaration, entry) = c_field(&ctype, field);
                    writeln!(out, "  {declaration};").expect("a text");
                    entries.push(format!("  {entry}"));
                }
                let entries = entries.join(",\n");
                writeln!(out, "}} {ctype};\nARMOR_STRUCT({ctype}, \"{name}\",\n{entries});")
                    .expect("a text");
            }
            other => panic!("{other} is no message"),
        }
    }
    out + "\n#endif  // ARMOR_MESSAGES_H\n"
}

/// The C++ type of a field; a view borrows texts and lists.
fn cpp_type(schema: &Schema, is_view: bool) -> String {
    match schema {
        Schema::Text if is_view => "std::string_view".into(),
        Schema::Text => "std::string".into(),
        Schema::Fixed(item, count) => format!("std::array<{}, {count}>", cpp_type(item, false)),
        Schema::List(item) if is_view => format!("armor::span<const {}>", cpp_type(item, false)),
        Schema::List(item) => format!("std::vector<{}>", cpp_type(item, false)),
        other => match plain(other) {
            Some((ctype, _)) => ctype.into(),
            None => name_of(other).into(),
        },
    }
}

fn write_cpp_struct(
    out: &mut String,
    docs: &BTreeMap<String, Vec<String>>,
    name: &str,
    fields: &[Field],
    is_view: bool,
) {
    let struct_name = if is_view { format!("{name}View") } else { name.to_owned() };
    if is_view {
        writeln!(out, "// As `{name}`, with texts and lists that are borrowed: from the message that has arrived, or\n// from the sender's memory.").expect("a text");
    } else {
        write_doc(out, docs, name, "");
    }
    writeln!(out, "struct {struct_name} {{").expect("a text");
    let mut entries = Vec::new();
    for field in fields {
        write_doc(out, docs, &format!("{name}.{}", field.name), "  ");
        let default = DEFAULTS.iter().find(|(of, it, _)| *of == name && *it == field.name);
        let default = match default {
            Some((_, _, value)) => format!(" = {value}"),
            None => "{}".into(),
        };
        let declared = cpp_type(&field.schema, is_view);
        writeln!(out, "  {declared} {}{default};", field.name).expect("a text");
        entries.push(match &field.unit {
            Some(unit) => format!("({}, \"{unit}\")", field.name),
            None => field.name.clone(),
        });
    }
    let entries = entries.join(", ");
    writeln!(out, "}};\nARMOR_MESSAGE_NAMED(\"{name}\", {struct_name}, {entries})")
        .expect("a text");
}

fn generate_cpp() -> String {
    let docs = read_docs();
    let mut out = format!(
        "// The standard messages, with the names and fields of armor-sdk; units and axes by REP-103.\n\
         // Generated from sdk/src/messages; {HINT}\n\n\
         #ifndef ARMOR_MESSAGES_HPP\n#define ARMOR_MESSAGES_HPP\n\n#include <cmath>\n\n\
         #include \"armor.hpp\"\n\nnamespace armor::messages {{\n"
    );
    for message in standard_schemas() {
        let name = name_of(&message).to_owned();
        out.push('\n');
        match &message {
            Schema::Enum { variants, .. } => {
                write_doc(&mut out, &docs, &name, "");
                writeln!(out, "enum class {name} : uint32_t {{").expect("a text");
                for Variant { name: variant, .. } in variants {
                    write_doc(&mut out, &docs, &format!("{name}.{variant}"), "  ");
                    writeln!(out, "  {variant},").expect("a text");
                }
                let names: Vec<_> = variants.iter().map(|one| one.name.as_str()).collect();
                writeln!(out, "}};\nARMOR_MESSAGE_ENUM({name}, {})", names.join(", "))
                    .expect("a text");
            }
            Schema::Struct { fields, .. } => {
                write_cpp_struct(&mut out, &docs, &name, fields, false);
                let is_bulk = |field: &Field| matches!(&field.schema, Schema::List(item) if plain(item).is_some());
                if fields.iter().any(is_bulk) {
                    out.push('\n');
                    write_cpp_struct(&mut out, &docs, &name, fields, true);
                }
            }
            other => panic!("{other} is no message"),
        }
    }
    out + "\n}  // namespace armor::messages\n\n#endif  // ARMOR_MESSAGES_HPP\n"
}

fn check_kept(file: &str, generated: &str) {
    let path = crate_file(file);
    if std::env::var_os("ARMOR_BLESS").is_some() {
        std::fs::write(&path, generated).expect("written");
    }
    let kept = std::fs::read_to_string(&path).unwrap_or_default();
    assert!(kept == generated, "{file} differs from the standard messages; {HINT}");
}

#[test]
fn the_messages_of_c_are_those_of_rust() {
    check_kept("include/armor_messages.h", &generate_c());
}

#[test]
fn the_messages_of_cpp_are_those_of_rust() {
    check_kept("include/armor_messages.hpp", &generate_cpp());
}
