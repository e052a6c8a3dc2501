//! The name of the type of a component.

/// `laser-scanner` is a `LaserScanner`; where the source file has that word already, as `Count`, it is a
/// `CountComponent`.
pub fn type_name_in(source: &str, name: &str) -> String {
    let words = name.split(['-', '_']).filter(|word| !word.is_empty());
    let name: String = words.map(|word| word[..1].to_uppercase() + &word[1..]).collect();
    let is_taken = source.split(|c: char| !c.is_alphanumeric()).any(|word| word == name);
    if is_taken { name + "Component" } else { name }
}
