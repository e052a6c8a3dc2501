//! Lists of bytes, such as pictures, for a terminal: as arrays, which it shows shortened.

use armor_wire::schema::Schema;
use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use serde_json::Value;

/// Replaces the base64 of each list of more than `max` bytes by the array of its numbers.
pub fn expand_byte_lists(schema: &Schema, value: &mut Value, max: usize) {
    match (schema, value) {
        (Schema::List(item), value @ Value::String(_)) if **item == Schema::U8 => {
            let bytes = value.as_str().and_then(|text| STANDARD.decode(text).ok());
            if let Some(bytes) = bytes.filter(|bytes| bytes.len() > max) {
                *value = bytes.into();
            }
        }
        (Schema::List(item) | Schema::Fixed(item, _), Value::Array(items)) => {
            for value in items {
                expand_byte_lists(item, value, max);
            }
        }
        (Schema::Option(item), value) => expand_byte_lists(item, value, max),
        (Schema::Struct { fields, .. }, Value::Object(values)) => {
            for field in fields {
                if let Some(value) = values.get_mut(&field.name) {
                    expand_byte_lists(&field.schema, value, max);
                }
            }
        }
        (Schema::Enum { variants, .. }, Value::Object(chosen)) => {
            for variant in variants {
                let Some(Value::Object(values)) = chosen.get_mut(&variant.name) else { continue };
                for field in &variant.fields {
                    if let Some(value) = values.get_mut(&field.name) {
                        expand_byte_lists(&field.schema, value, max);
                    }
                }
            }
        }
        _ => {}
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn a_picture_is_an_array_and_what_is_short_or_no_bytes_stays() {
        let text = "Frame{data:[u8],mark:[u8],note:string,tiles:[Tile{data:[u8]}],\
                    state:State<Off,On{data:[u8]}>,thumb:?[u8]}";
        let schema = armor_wire::schema::parse(text).expect("a schema");
        let (long, short) = (STANDARD.encode([200; 90]), STANDARD.encode([1, 2]));
        let mut value = json!({
            "data": long, "mark": short, "note": long, "tiles": [{"data": long}],
            "state": {"On": {"data": long}}, "thumb": null,
        });
        expand_byte_lists(&schema, &mut value, 8);
        let bytes = vec![200; 90];
        let expected = json!({
            "data": bytes, "mark": short, "note": long, "tiles": [{"data": bytes}],
            "state": {"On": {"data": bytes}}, "thumb": null,
        });
        assert_eq!(value, expected);
    }
}
