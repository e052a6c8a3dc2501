//! A component and a tool on another host, while the system listens on loopback only. They reach
//! the system through a SOCKS5 proxy such as `ssh -D`; the system reaches them on one forwarded
//! port.

use std::io::{Read, Write};
use std::net::{Shutdown, SocketAddr, TcpListener, TcpStream};
use std::sync::{Arc, Mutex};

use serde_json::Value;

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

/// A SOCKS5 proxy that records the targets of all requests.
struct Proxy {
    address: SocketAddr,
    asked: Arc<Mutex<Vec<String>>>,
}

impl Proxy {
    fn start() -> Self {
        let listener = TcpListener::bind("127.0.0.1:0").expect("a port");
        let address = listener.local_addr().expect("its address");
        let asked = Arc::new(Mutex::new(Vec::new()));
        let targets = Arc::clone(&asked);
        std::thread::spawn(move || {
            for stream in listener.incoming().flatten() {
                let targets = Arc::clone(&targets);
                std::thread::spawn(move || Self::serve(&stream, &targets));
            }
        });
        Self { address, asked }
    }

    fn serve(mut client: &TcpStream, asked: &Mutex<Vec<String>>) -> Option<()> {
        let mut greeting = [0; 3];
        client.read_exact(&mut greeting).ok()?;
        assert_eq!(greeting, [5, 1, 0], "no password is offered");
        client.write_all(&[5, 0]).ok()?;
        let mut head = [0; 5];
        client.read_exact(&mut head).ok()?;
        let mut rest = vec![0; usize::from(head[4]) + 2];
        client.read_exact(&mut rest).ok()?;
        let (host, port) = rest.split_at(usize::from(head[4]));
        let port = u16::from_be_bytes([port[0], port[1]]);
        let target = format!("{}:{port}", String::from_utf8_lossy(host));
        asked.lock().expect("no panic").push(target.clone());
        let Ok(server) = TcpStream::connect(target) else {
            return client.write_all(&[5, 5, 0, 1, 0, 0, 0, 0, 0, 0]).ok();
        };
        client.write_all(&[5, 0, 0, 1, 0, 0, 0, 0, 0, 0]).ok()?;
        let (from, to) = (client.try_clone().ok()?, server.try_clone().ok()?);
        let back = std::thread::spawn(move || pass(&to, &from));
        pass(client, &server);
        back.join().ok()
    }

    fn was_asked_for(&self, address: &str) -> bool {
        self.asked.lock().expect("no panic").iter().any(|asked| asked == address)
    }
}

fn pass(mut from: &TcpStream, mut to: &TcpStream) {
    let _ = std::io::copy(&mut from, &mut to);
    let _ = to.shutdown(Shutdown::Both);
}

/// Runs a tool as on the far host; returns its output, one JSON object per line.
fn lines(folder: &Folder, tool: &[&str], proxy: &Proxy) -> Vec<Value> {
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

    let proxy = Proxy::start();
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
        log.contains("--without fat: no component is called that; there are near, far"),
        "{log}"
    );
}
