//! The reference in a `.prj` file (well-known text), as far as it is one of those supported.

use crate::reference::MapReference;

/// Finds the reference of a well-known text: by its EPSG number, else by the names that programs of
/// Esri write. Otherwise returns what the text names.
pub(crate) fn find_reference(text: &str) -> Result<MapReference, String> {
    let text = text.trim_start_matches('\u{feff}').trim();
    // The number of the whole comes last; those before it are of its parts.
    let number = [r#"AUTHORITY["EPSG","#, r#"ID["EPSG","#].iter().find_map(|key| {
        let rest = text.get(text.rfind(key)? + key.len()..)?;
        let after = rest.split(['[', ']']).nth(1)?;
        let is_last = after.is_empty() && rest.matches(']').count() <= 2;
        let digits = rest.split(']').next()?.trim_matches(['"', ' ']);
        is_last.then(|| digits.parse::<u32>().ok())?
    });
    if let Some(number) = number {
        return MapReference::from_epsg(number).ok_or_else(|| format!("EPSG {number}"));
    }
    let name = text.split('"').nth(1).unwrap_or_default();
    let reference = match name {
        "GCS_WGS_1984" | "WGS 84" => Some(MapReference::Wgs84),
        "WGS_1984_Web_Mercator_Auxiliary_Sphere" | "WGS 84 / Pseudo-Mercator" => {
            Some(MapReference::WebMercator)
        }
        _ => find_zone(name),
    };
    reference.ok_or_else(|| {
        let shown: String = name.chars().take(60).collect();
        format!("`{shown}`")
    })
}

/// `WGS_1984_UTM_Zone_31N` or `WGS 84 / UTM zone 31N`.
fn find_zone(name: &str) -> Option<MapReference> {
    let zone = ["WGS_1984_UTM_Zone_", "WGS 84 / UTM zone "]
        .iter()
        .find_map(|prefix| name.strip_prefix(prefix))?;
    let (digits, base) = match zone.strip_suffix('N') {
        Some(digits) => (digits, 32600),
        None => (zone.strip_suffix('S')?, 32700),
    };
    let number: u8 = digits.parse().ok().filter(|number| (1..=60).contains(number))?;
    MapReference::from_epsg(base + u32::from(number))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_and_names_are_found() {
        let check = |text: &str, epsg| {
            let found = find_reference(text).map(|reference| reference.epsg().unwrap());
            assert_eq!(found, epsg, "{text}");
        };
        check(
            r#"PROJCS["x",GEOGCS["WGS 84",AUTHORITY["EPSG","4326"]],AUTHORITY["EPSG","32631"]]"#,
            Ok(32631),
        );
        check(r#"PROJCRS["x",BASEGEOGCRS["y",ID["EPSG",4326]],ID["EPSG",3857]]"#, Ok(3857));
        check(r#"PROJCS["x",AUTHORITY["EPSG","2154"]]"#, Err("EPSG 2154".to_owned()));
        check(r#"PROJCS["WGS_1984_UTM_Zone_7S",GEOGCS["GCS_WGS_1984"]]"#, Ok(32707));
        check(r#"GEOGCS["GCS_WGS_1984",DATUM["D_WGS_1984"]]"#, Ok(4326));
        check(
            r#"PROJCS["Lambert",GEOGCS["WGS 84",AUTHORITY["EPSG","4326"]],UNIT["m",1]]"#,
            Err("`Lambert`".to_owned()),
        );
        check("", Err("``".to_owned()));
    }
}
