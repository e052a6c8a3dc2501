//! Thousands of damaged files of every kind: each is opened or refused, and none makes a panic or
//! takes more memory than the limits allow.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};

use armor_tiles::Source;
use fastrand::Rng;
use tempfile::tempdir;
use tiff::encoder::Compression;

use crate::written::{
    ArchiveForm, color_at, geotiff_bytes, jpeg_bytes, pmtiles_bytes, png_bytes,
    tiled_geotiff_bytes, write, write_mbtiles,
};

/// Damaged files of each kind; `ARMOR_TILES_DAMAGED` sets another number.
const INPUTS: u64 = 500;
/// Tiles that are decoded of a file that opens.
const DECODED: usize = 3;

/// One to six damages of bytes, as often at the beginning as elsewhere: headers are there.
fn damage(bytes: &mut Vec<u8>, rng: &mut Rng) {
    for _ in 0..rng.usize(1..=6) {
        let reach = if rng.bool() { bytes.len().min(300) } else { bytes.len() };
        let at = rng.usize(..=reach);
        let end = (at + rng.usize(..=16)).min(bytes.len());
        match rng.u8(..6) {
            0 if at < bytes.len() => bytes[at] ^= 1 << rng.u8(..8),
            1 => bytes[at..end].iter_mut().for_each(|byte| *byte = rng.u8(..)),
            2 => bytes[at..end].fill(if rng.bool() { 0xff } else { 0 }),
            3 => drop(bytes.drain(at..end)),
            4 => {
                let piece = bytes[at..end].repeat(rng.usize(1..20));
                drop(bytes.splice(at..at, piece));
            }
            _ if rng.u8(..4) == 0 => bytes.truncate(at),
            _ => {}
        }
    }
}

fn look_at(path: &Path) {
    match Source::open(path) {
        Err(error) => assert!(!error.to_string().is_empty()),
        Ok(source) => {
            let bounds = source.bounds();
            assert!(bounds.width() >= 0.0 && bounds.height() >= 0.0, "{bounds:?}");
            let fine = 1.0 / source.units_per_pixel();
            for scale in [fine, fine / 16.0] {
                for id in source.wanted(bounds, scale).into_iter().take(DECODED) {
                    match source.decode(id) {
                        Ok(Some(image)) => {
                            let len = image.width as usize * image.height as usize * 4;
                            assert_eq!(image.rgba.len(), len);
                        }
                        Ok(None) => {}
                        Err(error) => assert!(!error.to_string().is_empty()),
                    }
                }
            }
        }
    }
}

/// With `ARMOR_BLESS` the first file of each kind becomes a seed of `tests/hostile`.
fn bless_seed(name: &str, whole: &[u8]) {
    let seeds = Path::new(env!("CARGO_MANIFEST_DIR")).join("../tests/hostile/pictures");
    let path = seeds.join(name.replace("map.yaml", "a.yaml"));
    let is_seed = !["a.pgw", "a.prj", "map.pgm"].contains(&name);
    if is_seed && std::env::var_os("ARMOR_BLESS").is_some() && !path.exists() {
        std::fs::create_dir_all(seeds).unwrap();
        std::fs::write(path, whole).unwrap();
    }
}

/// Damages the file `name` among others that belong to it.
#[track_caller]
fn check(name: &str, whole: &[u8], others: &[(&str, &[u8])]) {
    let folder = tempdir().unwrap();
    for (other, bytes) in others {
        write(folder.path(), other, bytes);
    }
    let opened = others.first().map_or(name, |(first, _)| {
        // The first one is opened if it names the damaged one.
        if first.ends_with("yaml") || first.ends_with("png") { first } else { name }
    });
    let path: PathBuf = folder.path().join(opened);
    write(folder.path(), name, whole);
    let source = Source::open(&path).unwrap_or_else(|error| panic!("the whole file: {error}"));
    bless_seed(name, whole);
    let id = source.wanted(source.bounds(), 1.0 / source.units_per_pixel())[0];
    source.decode(id).unwrap();
    drop(source);
    let variable = std::env::var("ARMOR_TILES_DAMAGED");
    let count = variable.ok().and_then(|count| count.parse().ok()).unwrap_or(INPUTS);
    for number in 0..count {
        let mut bytes = whole.to_vec();
        damage(&mut bytes, &mut Rng::with_seed(number));
        write(folder.path(), name, &bytes);
        if catch_unwind(AssertUnwindSafe(|| look_at(&path))).is_err() {
            panic!("seed {number} of {name}");
        }
    }
}

const WORLD: &[u8] = b"0.5\n0\n0\n-0.5\n100.25\n49.75\n";
const FORM: ArchiveForm = ArchiveForm {
    kind: 2,
    is_compressed: false,
    leaf_entries: 2,
    degrees: [-10.0, 40.0, 10.0, 60.0],
};

fn tiles() -> Vec<(u8, u32, u32, Vec<u8>)> {
    let tile = |zoom, x, y| (zoom, x, y, png_bytes(16, 16, color_at));
    vec![tile(0, 0, 0), tile(1, 0, 0), tile(1, 1, 0), tile(2, 1, 1), tile(2, 2, 1)]
}

#[test]
fn any_png_gets_an_answer() {
    check("a.png", &png_bytes(40, 30, color_at), &[("a.pgw", WORLD)]);
}

#[test]
fn any_jpeg_gets_an_answer() {
    check("a.jpg", &jpeg_bytes(40, 30, [1, 99, 200]), &[("a.jgw", WORLD)]);
}

#[test]
fn any_world_file_gets_an_answer() {
    check("a.pgw", WORLD, &[("a.png", &png_bytes(4, 3, color_at))]);
}

#[test]
fn any_projection_gets_an_answer() {
    let text =
        br#"PROJCS["x",GEOGCS["WGS 84",AUTHORITY["EPSG","4326"]],AUTHORITY["EPSG","32631"]]"#;
    check("a.prj", text, &[("a.png", &png_bytes(4, 3, color_at)), ("a.pgw", WORLD)]);
}

#[test]
fn any_map_gets_an_answer() {
    let yaml = b"image: map.pgm\nresolution: 0.05\norigin: [-1.0, 2.0, 0.1]\nnegate: 0\n\
        occupied_thresh: 0.65\nfree_thresh: 0.196\n";
    let pgm = b"P5\n4 2\n200\n\x00\x64\xc8\xc8\xc8\xc8\xc8\x00";
    check("map.yaml", yaml, &[("map.pgm", pgm)]);
    check("map.pgm", pgm, &[("map.yaml", yaml)]);
}

#[test]
fn any_pmtiles_get_an_answer() {
    check("a.pmtiles", &pmtiles_bytes(&tiles(), FORM), &[]);
    let form = ArchiveForm { is_compressed: true, ..FORM };
    check("a.pmtiles", &pmtiles_bytes(&tiles(), form), &[]);
}

#[test]
fn any_mbtiles_get_an_answer() {
    let folder = tempdir().unwrap();
    let path = folder.path().join("a.mbtiles");
    write_mbtiles(&path, &tiles(), &[("format", "png"), ("bounds", "-10,40,10,60")], 1_024);
    check("a.mbtiles", &std::fs::read(path).unwrap(), &[]);
}

#[test]
fn any_geotiff_gets_an_answer() {
    for compression in [Compression::Uncompressed, Compression::Lzw, Compression::Packbits] {
        check("a.tif", &geotiff_bytes(40, 30, compression, 3857), &[]);
    }
    check("a.tif", &tiled_geotiff_bytes(150, 100, None), &[]);
}

#[test]
fn any_world_gets_an_answer() {
    let world =
        br#"<svg><rect x="0" y="0" width="20" height="10"/><circle id="start" cx="5" cy="4"/>
        <path d="M1 1 h3 v-2 z"/></svg>"#;
    check("a.svg", world, &[]);
}

#[test]
fn any_geojson_gets_an_answer() {
    let plan = br#"{"type":"FeatureCollection","crs":{"properties":{"name":"local"}},"features":[
        {"type":"Feature","geometry":{"type":"MultiPolygon","coordinates":[[[[0,0],[9,0],[9,9],[0,0]]]]}},
        {"type":"Feature","geometry":{"type":"GeometryCollection","geometries":[
        {"type":"LineString","coordinates":[[0,0],[3,4.5]]}]}}]}"#;
    check("a.geojson", plan, &[]);
}
