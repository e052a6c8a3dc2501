//! The file itself: bytes, XML, vocabulary, and the other files that it names.

use std::path::Path;

use armor_robotfile::read;

use super::{found_in, mission, none, one, system};

#[test]
fn bytes_and_xml() {
    one("E0004", "");
    one("E0004", "<armor version=\"1\"><system/></armor>[[<]]");
    one("E0004", "<armor version=\"1\"><system/></armor><[[armor]]/>");
    one("E0004", "<armor version=\"1\"><system/></armor>[[more]]");
    one("E0004", &system(r#"<component [[name]] kind="k"/>"#));
    one(
        "E0004",
        &system(
            r#"<component name="a" kind="k"><parameter name="p" value="1[[<]]2"/></component>"#,
        ),
    );
    one("E0004", &system(r#"<component name="a"[[kind]]="k"/>"#));
    one("E0004", &system("[[<!-- a -- b -->]]"));
    one("E0005", "[[<!DOCTYPE]] armor [<!ENTITY a \"b\">]><armor version=\"1\"><system/></armor>");
    one(
        "E0009",
        &system(
            r#"<component name="a" kind="k"><parameter name="p" value="[[&nbsp;]]"/></component>"#,
        ),
    );
    one(
        "E0009",
        &system(
            r#"<component name="a" kind="k"><parameter name="p" value="a [[&]] b"/></component>"#,
        ),
    );
    one("E0010", &system("<!-- [[\u{7}]] -->"));
    one("E0011", &system(r#"<component name="a" kind="k" [[name]]="b"/>"#));
    one("E0012", "<armor version=\"1\"><[[system]]></armor>");
    one("E0012", &system("[[</component>]]"));
    one("E0013", &system(r#"<component name="a" kind="k" [[my:note]]="x"/>"#));
    one("E0013", "<armor version=\"1\" [[xmlns]]=\"urn:a\"><system/></armor>");
}

#[test]
fn vocabulary() {
    one("E0028", "<armor version=\"1\" [[draft]]=\"true\"><system/></armor>");
    one("W0131", "<armor version=\"1\" draft=\"false\"><[[system]]/></armor>");
    one("E0014", &system("[[hello]]"));
    one("E0015", &system("<[[componant]]/>"));
    one("E0016", &system(r#"<component name="a" kind="k" [[kond]]="x"/>"#));
    one("E0017", &system(r#"<[[component]] name="a"/>"#));
    one("E0018", &system(r#"<component name="[[a b]]" kind="k"/>"#));
    one("E0018", &system(r#"<component name="a" kind="[[]]"/>"#));
    one("E0019", &system(r#"<component name="a" kind="k" rate="[[10]]"/>"#));
    one("E0019", &system(r#"<component name="a" kind="k" rate="[[10s]]"/>"#));
    one("E0019", &system(r#"<component name="a" kind="k" restart="[[maybe]]"/>"#));
    one("E0019", &system(r#"<component name="a" kind="k" watchdog="[[0s]]"/>"#));
    one("E0019", &system(r#"<component name="a" kind="k" controllable="[[yes]]"/>"#));
    one("E0019", &system(r#"<component name="a" kind="k"/><link from="[[a]]" to="a.x"/>"#));
    one(
        "E0019",
        &system(r#"<component name="a" kind="k"/><link from="a.x" to="a.y" keep="[[none]]"/>"#),
    );
    one("E0019", &mission(r#"<transition name="t" from="a" timeout="[[1e300h]]"/>"#));
    one("E0019", &mission(r#"<transition name="t" from="a" interval="[[5s]]"/>"#));
    one("E0019", &mission(r#"<transition name="t" from="a" not-before="[[tomorrow]]"/>"#));
    one("E0019", &mission("<[[check]]> </check>"));
    one("E0020", "<[[robot]]/>");
    one("E0020", "<armor version=\"[[2]]\"><system/></armor>");
    one("E0021", "<armor version=\"1\"><system/><[[system]]/></armor>");
    one("E0022", "<[[armor]] version=\"1\"/>");
    one("E0026", &mission(r#"<transition name="t" from="a" timeout="1s" [[after]]="2s"/>"#));
}

#[test]
fn a_wrong_quantity_is_named_and_the_right_one_shown() {
    for (file, words) in [
        (mission(r#"<transition name="t" from="a" timeout="1m"/>"#), "it is a length: write 1min"),
        (mission(r#"<transition name="t" from="a" timeout="90"/>"#), "it has no unit: write 90s"),
        (mission(r#"<transition name="t" from="a" after="5V"/>"#), "it is a voltage; a duration"),
        (mission(r#"<transition name="t" from="a" timeout="soon"/>"#), "a duration such as"),
        (system(r#"<component name="a" kind="k" rate="10"/>"#), "it has no unit: write 10Hz"),
        (system(r#"<component name="a" kind="k" rate="0.1s"/>"#), "it is a time; a rate such as"),
        (system(r#"<component name="a" kind="k" watchdog="2"/>"#), "it has no unit: write 2s"),
    ] {
        let (codes, shown) = found_in(&file);
        assert!(codes == ["E0019"] && shown.contains(words), "{words}\n{shown}");
    }
}

#[test]
fn what_a_component_may_use_is_a_number_a_list_or_an_amount() {
    for (attribute, words) in [
        (r#"nice="20""#, "from -20"),
        (r#"realtime="0""#, "from 1 to 99"),
        (r#"cpus="0,1""#, "such as \"0 2-3\""),
        (r#"cpu="0.5""#, "such as 50%"),
        (r#"cpu="0.5%""#, "1% or more"),
        (r#"memory="512""#, "such as 512MiB"),
        (r#"memory="1kB""#, "at least 16MiB"),
    ] {
        let (codes, shown) =
            found_in(&system(&format!(r#"<component name="a" kind="k" {attribute}/>"#)));
        assert!(codes == ["E0019"] && shown.contains(words), "{words}\n{shown}");
    }
    let all = r#"<component name="a" kind="k" nice="-5" cpus="0 2-3" cpu="250%" memory="64MiB"/>"#;
    none(&system(all));
    one("W0027", &system(r#"<component name="a" kind="k" realtime="10" nice="[[-5]]"/>"#));
    one("W0027", &system(r#"<component name="a" kind="k" realtime="10" cpu="[[50%]]"/>"#));
    one("W0027", &system(r#"<component name="a" kind="k" cpus="0-1" cpu="[[200%]]"/>"#));
}

#[test]
fn patience_is_for_a_sender_that_waits() {
    let link = |attributes: &str| {
        let port = r#"<component name="a" kind="k"/><component name="b" kind="k"/>"#;
        system(&format!(r#"{port}<link from="a.x" to="b.y" {attributes}/>"#))
    };
    none(&link(r#"keep="all" patience="0.5s""#));
    one("W0027", &link(r#"[[patience]]="1s""#));
    one("W0027", &link(r#"keep="10" [[patience]]="1s""#));
    for wrong in ["0s", "1", "soon", "-1s"] {
        one("E0019", &link(&format!(r#"keep="all" patience="[[{wrong}]]""#)));
    }
}

#[test]
fn a_host_has_one_address_or_several() {
    let host = |at: &str| {
        system(&format!(r#"<host name="h" at="{at}"/><component name="a" kind="k" host="h"/>"#))
    };
    for at in [
        "arm.local",
        " arm:1  10.0.0.2:7410\n[fd00::2]:7410 fd00::3 ",
        "arm arm:7410",
        "mdns",
        "10.0.0.2 mdns",
    ] {
        none(&host(at));
    }
    let nine: Vec<_> = (0..9).map(|number| format!("10.0.0.{number}")).collect();
    for (at, words) in [
        ("", "with spaces between them"),
        (" ", "with spaces between them"),
        ("arm.local, 10.0.0.2", "an address such as arm.local"),
        ("arm:0", "an address such as arm.local"),
        ("arm 10.0.0.2:99999", "an address such as arm.local"),
        (&nine.join(" "), "at most 8 addresses"),
    ] {
        let (codes, shown) = found_in(&host(at));
        assert!(codes == ["E0019"] && shown.contains(words), "{at}\n{shown}");
    }
}

#[test]
fn other_files() {
    one("E0023", "<armor version=\"1\"><mission system=\"[[gone.xml]]\"/></armor>");
    one("E0024", "<armor version=\"1\"><mission system=\"[[./a.xml]]\"/></armor>");
    one(
        "E0025",
        "<armor version=\"1\"><system/><mission safe=\"a\" system=\"[[b.xml]]\"><place name=\"a\" initial=\"true\"/></mission></armor>",
    );
    let reading = read(Path::new("a.xml"), &mut |path| {
        let other = if path.ends_with("a.xml") { "b.xml" } else { "a.xml" };
        Ok(format!("<armor version=\"1\"><mission system=\"{other}\"/></armor>").into())
    });
    let codes: Vec<_> = reading.findings.iter().map(|finding| finding.code.as_str()).collect();
    assert_eq!(codes, ["E0024"]);
    let reading = read(Path::new("a.xml"), &mut |_| Err(std::io::ErrorKind::NotFound.into()));
    assert_eq!(reading.findings.iter().next().unwrap().code.as_str(), "E0003");
}

#[test]
fn the_number_of_files_is_bounded() {
    let mut asked = 0;
    let reading = read(Path::new("0.xml"), &mut |path| {
        asked += 1;
        let n: u32 = path.file_stem().unwrap().to_str().unwrap().parse().unwrap();
        Ok(format!(
            r#"<armor version="1"><mission safe="a"><place name="a" initial="true"/><submission ref="{}.xml"/><submission ref="{}.xml"/></mission></armor>"#,
            n + 1,
            n + 2
        )
        .into())
    });
    let codes: Vec<_> = reading.findings.iter().map(|finding| finding.code.as_str()).collect();
    assert!(codes.contains(&"E0008") && asked == 64, "{asked} {codes:?}");
}
