//! A component and a tool on another host, while the system listens on loopback only. They reach
//! the system through a SOCKS5 proxy such as `ssh -D`; the system reaches them on one forwarded
//! port.

use serde_json::Value;

use crate::fixture::fault_proxy::FaultProxy;
use crate::fixture::{Folder, free_port, run_to_end, wait_for};

const WORLD: &str = r#"<svg><rect x="-3" y="-3" width="6" height="6"/>
    <circle id="start" cx="-1" cy="0.5"/>
    <circle class="start" id="blue" cx="1" cy="0.5"/></svg>"#;

const SYSTEM: &str = r#"<armor version="1">
  <system name="far-robots">
    <component name="near" kind="simulator" rate="50Hz">
      <parameter name="world" value="room.svg"/>
    </component>
    <component name="far" kind="simulator" rate="50Hz">
      <parameter name="world" value="room.svg"/>
      <parameter name="start" value="blue"/>
    </component>
    <link from="near.presence" to="far.other1" transport="tcp"/>
    <link from="far.presence" to="near.other1" transport="tcp"/>
  </system>
</armor>"#;

/// Runs a tool as on the far host; returns its output, one JSON object per line.
fn lines(folder: &Folder, tool: &[&str], proxy: &FaultProxy) -> Vec<Value> {
    let mut command = folder.armor(tool);
    command.args(["--format", "json"]).env("ARMOR_VIA", proxy.address.to_string());
    let (code, out, _) = run_to_end(&mut command);
    if code != 0 {
        return Vec::new();
    }
    out.lines().filter_map(|line| serde_json::from_str(line).ok()).collect()
}

#[test]
fn a_component_on_another_host_takes_part_through_one_proxy_and_one_port() {
    let folder = Folder::new("remote");
    folder.write("room.svg", WORLD);
    let file = folder.write("robots.xml", SYSTEM);
    let file = file.to_str().expect("a path");
    let run = folder.run("out", &[file, "--headless", "--without", "far"]);
    let registry = run.registry().to_string();

    let proxy = FaultProxy::start(0);
    let port = free_port();
    let mut far = folder.armor(&["component", "simulator", "--name", "far"]);
    far.args(["--registry", &registry]).env("ARMOR_VIA", proxy.address.to_string());
    let mut far = far.env("ARMOR_PORT", port.to_string()).spawn().expect("it starts");

    let at = ["--registry", registry.as_str()];
    let endpoint = wait_for(&format!("far in the registry\n{}", run.log()), || {
        let all = lines(&folder, &[&["ps"], &at[..]].concat(), &proxy);
        let far = all.iter().find(|one| one["name"] == "far")?;
        far["endpoint"].as_str().map(str::to_owned)
    });
    assert_eq!(endpoint, format!("127.0.0.1:{port}"));
    for data in ["near.presence", "far.presence"] {
        wait_for(&format!("{data} to travel\n{}", run.log()), || {
            let links = lines(&folder, &[&["graph"], &at[..]].concat(), &proxy);
            let link = links.iter().find(|link| link["from"] == data)?;
            (link["received"].as_u64()? > 20).then_some(())
        });
    }
    assert!(proxy.was_asked_for(&registry), "the registry is reached through the proxy");
    let near = lines(&folder, &[&["ps"], &at[..]].concat(), &proxy);
    let near = near.iter().find(|one| one["name"] == "near").expect("near is there");
    let near = near["endpoint"].as_str().expect("its endpoint");
    assert!(proxy.was_asked_for(near), "and so is the robot");
    let _ = far.kill();
    let _ = far.wait();
}

#[test]
fn a_missing_proxy_is_named() {
    let folder = Folder::new("no-proxy");
    let port = free_port();
    let mut command = folder.armor(&["ps", "--registry", "127.0.0.1:7411"]);
    let (code, _, log) = run_to_end(command.env("ARMOR_VIA", format!("127.0.0.1:{port}")));
    assert_ne!(code, 0);
    assert!(log.contains("the proxy (ARMOR_VIA)"), "{log}");
}

#[test]
fn a_run_through_a_proxy_is_refused() {
    let folder = Folder::new("not-far");
    let file = folder.system("robots", &[]);
    let mut command = folder.armor(&["run", &file, "--headless"]);
    let (code, _, log) = run_to_end(command.env("ARMOR_VIA", "127.0.0.1:1080"));
    assert!(code == 1 && log.contains("unset it to run one here"), "{code} {log}");
}

#[test]
fn a_component_to_leave_out_must_be_in_the_file() {
    let folder = Folder::new("without");
    folder.write("room.svg", WORLD);
    folder.write("robots.xml", SYSTEM);
    let (code, _, log) = run_to_end(&mut folder.armor(&["run", "robots.xml", "--without", "fat"]));
    assert_eq!(code, 1, "{log}");
    assert!(
        log.contains("no component is called that; did you mean far? (there are near, far)"),
        "{log}"
    );
}
