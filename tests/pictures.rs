//! Pictures as JPEG: from the simulator's camera over a link, and from a file.

use std::path::Path;

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use serde_json::Value;
use zune_jpeg::JpegDecoder;
use zune_jpeg::zune_core::bytestream::ZCursor;

use crate::fixture::{Folder, run_to_end, wait_for};

const WORLD: &str =
    r#"<svg><rect x="-6" y="-6" width="12" height="12"/><circle id="start"/></svg>"#;

/// A camera behind a link, one that reads a file, and one without a source.
fn system() -> String {
    let picture = Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/images/office-map.png");
    format!(
        r#"<armor version="1">
  <system name="pictures">
    <frame name="camera" in="base_link" x="0.1m" z="0.4m"/>
    <component name="simulator" kind="simulator" rate="50Hz">
      <parameter name="world" value="room.svg"/>
      <parameter name="camera_width" value="96"/>
      <parameter name="camera_height" value="72"/>
    </component>
    <component name="camera" kind="camera"/>
    <component name="album" kind="camera" rate="20Hz">
      <parameter name="files" value="{}"/>
      <parameter name="width" value="200"/>
    </component>
    <component name="blind" kind="camera" rate="20Hz">
      <parameter name="files" value="{}"/>
    </component>
    <link from="simulator.camera" to="camera.raw"/>
    <link from="simulator.camera" to="blind.raw"/>
  </system>
</armor>"#,
        picture.display(),
        picture.display()
    )
}

/// A decoded picture: red, green and blue of each pixel, row by row.
struct Picture {
    frame: String,
    width: usize,
    height: usize,
    rgb: Vec<u8>,
}

/// Returns the next picture of an output.
fn picture(folder: &Folder, output: &str) -> Option<Picture> {
    let (code, out, _) =
        run_to_end(&mut folder.armor(&["echo", output, "-n", "1", "--format", "json"]));
    let data: Value = (code == 0).then(|| serde_json::from_str(&out).ok()).flatten()?;
    let image = &data["value"];
    assert_eq!(image["format"], "jpeg");
    let file = STANDARD.decode(image["data"].as_str().expect("the file")).expect("base64");
    let mut decoder = JpegDecoder::new(ZCursor::new(file.as_slice()));
    let rgb = decoder.decode().expect("a JPEG that can be read");
    let (width, height) = decoder.dimensions().expect("decoded");
    Some(Picture { frame: image["frame"].as_str()?.to_owned(), width, height, rgb })
}

#[test]
fn pictures_of_a_link_and_of_a_file_are_jpegs() {
    let folder = Folder::new("pictures");
    folder.write("room.svg", WORLD);
    let file = folder.write("pictures.xml", &system());
    let run = folder.run("out", &[file.to_str().expect("a path"), "--headless"]);
    let wait =
        |output: &str| wait_for(&format!("a picture\n{}", run.log()), || picture(&folder, output));

    let seen = wait("camera.image");
    assert_eq!((seen.frame.as_str(), seen.width, seen.height), ("camera", 96, 72));
    let (ceiling, floor) = (&seen.rgb[..3], &seen.rgb[seen.rgb.len() - 3..]);
    assert!(ceiling[2] > ceiling[0] && floor[0] > floor[2], "{ceiling:?} {floor:?}");
    // The file is a map in black and white with another aspect ratio.
    let map = wait("album.image");
    let (dark, bright) = (map.rgb.iter().min(), map.rgb.iter().max());
    assert!(map.width == 200 && map.height != 150, "{}x{}", map.width, map.height);
    assert!(dark < Some(&60) && bright > Some(&230), "{dark:?} to {bright:?}");

    // While no subscriber is there, the camera makes one picture a second.
    let (code, out, err) = run_to_end(&mut folder.armor(&["hz", "camera.image", "-n", "3"]));
    assert_eq!(code, 0, "{out}{err}");
    run.wait_for_log("pictures come from one place", 1);
}
