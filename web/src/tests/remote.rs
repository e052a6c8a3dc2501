//! Persons on other hosts: invitations, sessions and roles.

use armor_wire::acting::KeyRole;

use super::remote_scene::{RemoteScene, read_tls, wait_for_end};
use super::*;

#[test]
fn a_link_logs_in_one_browser_for_its_time_also_after_a_restart() {
    let mut scene = RemoteScene::begin();
    let link = scene.invite("alice", KeyRole::Operator, 1);
    let cookie = {
        let mut browser = scene.browser();
        let (_, session) = browser.json("GET", "/api/session", "");
        assert_eq!(
            (session["login"].as_str(), session["host"].as_str()),
            (Some("needed"), Some("robot"))
        );
        let (status, response) = browser.log_in(&link);
        assert_eq!(status, 200, "{response}");
        let cookie = response.lines().find(|line| line.starts_with("set-cookie: ")).expect("one");
        for part in ["__Host-armor=", "Path=/;", "Secure", "HttpOnly", "SameSite=Strict"] {
            assert!(cookie.contains(part), "{cookie}");
        }
        assert!(!response.contains(&link), "the secret is not returned: {response}");
        assert_eq!(browser.log_in(&link).0, 200, "the same browser opens the link again");
        let mut thief = scene.browser();
        let (status, response) = thief.log_in(&link);
        assert_eq!(status, 403, "{response}");
        assert!(response.contains("used already") && thief.cookie.is_empty(), "{response}");
        browser.cookie
    };
    scene.restart();
    let mut browser = scene.browser();
    browser.cookie = cookie;
    let (_, session) = browser.json("GET", "/api/session", "");
    assert_eq!(
        (session["name"].as_str(), session["role"].as_str()),
        (Some("alice"), Some("operator"))
    );
    assert_eq!(browser.json("GET", "/api/system", "").0, 200);
    let (status, response) = browser.send("POST", "/api/logout", "");
    assert!(status == 200 && response.contains("Max-Age=0"), "{response}");
    assert_eq!(browser.json("GET", "/api/system", "").0, 401);
    let stored = std::fs::read_to_string(scene.file().path()).expect("the file");
    assert!(!stored.contains(&link), "{stored}");
}

#[test]
fn a_login_whose_answer_was_lost_is_repeated_by_the_same_browser_alone() {
    let scene = RemoteScene::begin();
    let link = scene.invite("alice", KeyRole::Operator, 1);
    let body = |digit: char| {
        let attempt = String::from(digit).repeat(40);
        format!(r#"{{"invite":"{link}","attempt":"{attempt}"}}"#)
    };
    // The cookie of the first answer is lost.
    assert_eq!(scene.browser().send("POST", "/api/login", &body('a')).0, 200);
    let (status, response) = scene.browser().send("POST", "/api/login", &body('b'));
    assert!(status == 403 && response.contains("used already"), "{response}");
    assert_eq!(scene.browser().log_in(&link).0, 403, "another browser with the link alone");
    let (status, response) = scene.browser().send("POST", "/api/login", &body('a'));
    assert!(status == 200 && response.contains("__Host-armor="), "{response}");
    let file = scene.file();
    let stored = file.current();
    assert_eq!((stored.list()[0].used, stored.count_sessions(stored.list()[0].id)), (1, 1));
    for short in ["", "a", "zz"] {
        let body = format!(r#"{{"invite":"{link}","attempt":"{short}"}}"#);
        assert_eq!(scene.browser().send("POST", "/api/login", &body).0, 400, "{short}");
    }
}

#[test]
fn the_page_learns_when_its_invitation_has_expired() {
    let scene = RemoteScene::begin();
    let mut browser = scene.browser();
    let (status, response) = browser.log_in(&scene.invite("alice", KeyRole::Observer, 1));
    assert_eq!(status, 200, "{response}");
    let file = scene.file();
    let ended_s = armor_keys::expiry::now_s() - 5;
    let until = file.current().list()[0].until_s.to_string();
    let text = std::fs::read_to_string(file.path()).expect("the file");
    std::fs::write(file.path(), text.replace(&until, &ended_s.to_string())).expect("written");
    let kept = response.split("Max-Age=").nth(1).and_then(|rest| rest.split(';').next());
    let kept_s: i64 = kept.expect("an age").parse().expect("a number");
    assert!(kept_s > 24 * 3600, "the cookie outlives the session: {kept_s}");
    let session = wait_for("the end", || {
        let (_, session) = browser.json("GET", "/api/session", "");
        (session["login"] == "needed").then_some(session)
    });
    assert_eq!(session["ended_s"], ended_s);
    let text = format!("your invitation expired at {}", armor_keys::expiry::format_time(ended_s));
    assert_eq!(session["problem"], text);
    let (status, answer) = browser.json("GET", "/api/system", "");
    assert_eq!((status, answer["error"]["what"].as_str()), (401, Some(text.as_str())));
}

#[test]
fn logins_go_through_while_all_requests_for_data_wait() {
    let scene = RemoteScene::begin();
    let alice = scene.browser_of("alice", KeyRole::Operator);
    let waiting = scene.server.take_asking();
    let bob = scene.browser_of("bob", KeyRole::Observer);
    assert_eq!(bob.json("GET", "/api/system", "").0, 200);
    assert_eq!(alice.send("POST", "/api/logout", "").0, 200);
    drop(waiting);
}

#[test]
fn a_stranger_gets_the_page_and_nothing_else() {
    let scene = RemoteScene::begin();
    let browser = scene.browser();
    for path in
        ["/", "/app.js", "/sw.js", "/manifest.webmanifest", "/api/session", "/authority.crt"]
    {
        assert_eq!(browser.send("GET", path, "").0, 200, "{path}");
    }
    let (_, page) = browser.send("GET", "/", "");
    let policy = format!("connect-src 'self' wss://{}\r\n", scene.host());
    assert!(page.contains(&policy) && !page.contains("frame-src"), "{page}");
    for (method, path, body) in [
        ("GET", "/api/system", ""),
        ("GET", "/api/data", ""),
        ("GET", "/api/data/base.count", ""),
        ("GET", "/api/data/base.count/stream", ""),
        ("GET", "/api/data/base.map/image", ""),
        ("GET", "/api/parameters", ""),
        ("PUT", "/api/parameters/a/b", "{\"value\":null}"),
        ("GET", "/api/mission", ""),
        ("POST", "/api/mission/orders", "{\"order\":\"pause\"}"),
        ("GET", "/api/stop", ""),
        ("POST", "/api/stop", ""),
        ("POST", "/api/stop/release", "{\"control\":\"x\"}"),
        ("GET", "/api/openapi.json", ""),
        ("GET", "/metrics", ""),
    ] {
        let (status, answer) = browser.json(method, path, body);
        assert_eq!(status, 401, "{method} {path} {answer}");
        assert!(
            answer["error"]["remedy"].as_str().unwrap().contains("armor keys invite"),
            "{answer}"
        );
    }
    for path in ["/api/live", "/api/control", "/api/stop/live"] {
        assert_eq!(browser.open(path).err(), Some(401), "{path}");
    }
    assert!(scene.robot.stops.lock().is_empty());
}

#[test]
fn each_role_may_what_it_may_with_a_key() {
    let scene = RemoteScene::begin();
    let release = r#"{"control":"x"}"#;
    let fire = r#"{"order":"fire","transition":"late"}"#;
    let set = r#"{"value":"1"}"#;
    for (role, control, order, parameter) in [
        (KeyRole::Observer, 403, 403, 403),
        (KeyRole::Operator, 101, 502, 403),
        // There is neither a mission nor configd: what is allowed ends there.
        (KeyRole::Engineer, 101, 502, 502),
    ] {
        let browser = scene.browser_of(role.name(), role);
        assert_eq!(browser.json("GET", "/api/system", "").0, 200, "{role}");
        assert_eq!(browser.json("POST", "/api/stop", "").0, 200, "{role} may stop the robot");
        let mut stop = browser.open("/api/stop/live").expect("open");
        stop.send(tungstenite::Message::text(r#"{"stop":true,"id":2}"#)).unwrap();
        assert_eq!(read_tls(&mut stop)["stopped"], true, "{role}");
        let opened = browser.open("/api/control").map_or_else(|status| status, |_| 101);
        assert_eq!(opened, control, "{role}");
        assert_eq!(browser.json("POST", "/api/stop/release", release).0, 403, "{role}: no token");
        let (status, answer) = browser.json("POST", "/api/mission/orders", fire);
        assert_eq!(status, order, "{role} {answer}");
        if role == KeyRole::Observer {
            let what =
                "firing a transition needs the role operator, and observer has the role observer";
            assert_eq!(answer["error"]["what"], what);
            let pause = browser.json("POST", "/api/mission/orders", r#"{"order":"pause"}"#);
            assert_eq!(pause.0, 502, "it may pause the mission that is not there: {}", pause.1);
        }
        let (status, answer) = browser.json("PUT", "/api/parameters/a/b", set);
        assert_eq!(status, parameter, "{role} {answer}");
        assert_eq!(browser.send("GET", "/metrics", "").0, 200, "{role}");
    }
}

#[test]
fn a_revocation_ends_open_connections_and_the_robot_stands() {
    let scene = RemoteScene::begin();
    let alice = scene.browser_of("alice", KeyRole::Operator);
    let bob = scene.browser_of("bob", KeyRole::Observer);
    let mut live = alice.open("/api/live").expect("open");
    live.send(tungstenite::Message::text(r#"{"subscribe":[{"name":"system"}]}"#)).unwrap();
    assert_eq!(read_tls(&mut live)["name"], "system");
    let mut stop = alice.open("/api/stop/live").expect("open");
    let mut others = bob.open("/api/live").expect("open");
    let mut events = scene.connect();
    let (host, cookie) = (scene.host(), &alice.cookie);
    let request = format!("GET /api/data/a.b/stream HTTP/1.1\r\nHost: {host}\r\n{cookie}\r\n");
    events.write_all(request.as_bytes()).unwrap();
    let mut byte = [0; 1];
    events.read_exact(&mut byte).expect("a response begins");
    let mut control = alice.open("/api/control").expect("open");
    read_tls(&mut control);
    let drive = r#"{"drive":{"forward_mps":0.2,"turn_radps":0}}"#;
    control.send(tungstenite::Message::text(drive)).unwrap();
    wait_for("the drive", || (!scene.robot.velocities.lock().is_empty()).then_some(()));

    scene.revoke("alice");
    wait_for_end(&mut control);
    wait_for_end(&mut live);
    wait_for_end(&mut stop);
    let _ = events.read_to_end(&mut Vec::new());
    wait_for("a halt", || {
        (scene.robot.velocities.lock().last() == Some(&(0.0, 0.0))).then_some(())
    });
    let (status, answer) = alice.json("GET", "/api/system", "");
    assert_eq!(status, 401);
    assert!(answer["error"]["what"].as_str().unwrap().contains("revoked"), "{answer}");
    let (_, session) = alice.json("GET", "/api/session", "");
    assert!(session["problem"].as_str().unwrap().contains("revoked"), "{session}");
    others.send(tungstenite::Message::text(r#"{"ping":7}"#)).unwrap();
    assert_eq!(read_tls(&mut others)["pong"], 7, "bob stays");
}

#[test]
fn a_link_of_another_person_ends_no_session_by_itself() {
    let scene = RemoteScene::begin();
    let mut browser = scene.browser_of("alice", KeyRole::Operator);
    let link = scene.invite("bob", KeyRole::Observer, 1);
    let (status, response) = browser.log_in(&link);
    assert!(status == 409 && response.contains("logged in as alice (operator)"), "{response}");
    assert_eq!(browser.json("GET", "/api/session", "").1["name"], "alice");
    let body = format!(r#"{{"invite":"{link}","replace":true}}"#);
    let (status, answer) = browser.json("POST", "/api/login", &body);
    assert!(status == 200 && answer["name"] == "bob", "{answer}");
    assert_eq!(browser.json("GET", "/api/session", "").1["login"], "needed", "alice's has ended");
}

#[test]
fn logging_out_ends_the_other_connections_of_the_browser() {
    let scene = RemoteScene::begin();
    let alice = scene.browser_of("alice", KeyRole::Operator);
    let mut live = alice.open("/api/live").expect("open");
    assert_eq!(alice.send("POST", "/api/logout", "").0, 200);
    wait_for_end(&mut live);
}

#[test]
fn the_certificate_of_the_authority_is_served_and_a_renewed_key_needs_no_restart() {
    let scene = RemoteScene::begin();
    let facts = scene.server.remote().expect("a server for other hosts");
    assert_eq!(facts.urls[0], format!("https://{}/", scene.host()));
    let (_, session) = scene.browser().json("GET", "/api/session", "");
    assert_eq!(session["fingerprint"], facts.fingerprint);
    let folder = armor_keys::KeysFolder::open(scene.keys.path()).unwrap();
    folder.renew_key("robot", &[], 10, armor_keys::expiry::now_s()).unwrap();
    wait_for("the new key", || {
        let (_, session) = scene.browser().json("GET", "/api/session", "");
        (session["fingerprint"] != facts.fingerprint).then_some(())
    });
    folder.revoke_keys("robot", armor_keys::expiry::now_s()).unwrap();
    wait_for("the end of the service", || {
        (scene.send("").0 == 0 && is_closed(&scene)).then_some(())
    });
    let options = WebOptions {
        listen: "0.0.0.0:0".parse().unwrap(),
        keys: Some(scene.keys.path().into()),
        registry: "127.0.0.1:1".into(),
        author: "ruth".into(),
    };
    let error = WebServer::start(&options, None).err().expect("refused").to_string();
    assert!(error.contains("is revoked") && error.contains("armor keys renew robot"), "{error}");
}

/// Whether no request is served any more.
fn is_closed(scene: &RemoteScene) -> bool {
    scene.browser().send("GET", "/api/session", "").0 == 0
}

#[test]
fn a_key_without_names_for_browsers_is_refused_with_the_remedy() {
    use std::os::unix::fs::PermissionsExt;
    let keys = tempfile::tempdir().unwrap();
    std::fs::set_permissions(keys.path(), std::fs::Permissions::from_mode(0o700)).unwrap();
    let now_s = armor_keys::expiry::now_s();
    let folder = armor_keys::KeysFolder::create(keys.path(), now_s).unwrap();
    let purpose = armor_keys::KeyPurpose::Host;
    let holder = armor_keys::KeyHolder { name: "robot".into(), purpose };
    folder.add_key(holder, 10, now_s).unwrap();
    let start = || {
        let options = WebOptions {
            listen: "0.0.0.0:0".parse().unwrap(),
            keys: Some(keys.path().into()),
            registry: "127.0.0.1:1".into(),
            author: "ruth".into(),
        };
        WebServer::start(&options, None).err().expect("refused").to_string()
    };
    let error = start();
    assert!(error.contains("armor keys renew robot --at"), "{error}");
    let sites = ["robot.test".parse().unwrap()];
    folder.renew_key("robot", &sites, 10, now_s - 100 * 24 * 3600).unwrap();
    let error = start();
    assert!(error.contains("has expired") && error.contains("armor keys renew robot"), "{error}");
    folder.renew_key("robot", &sites, 10, now_s + 10 * 24 * 3600).unwrap();
    let error = start();
    assert!(error.contains("is valid from") && error.contains("timedatectl"), "{error}");
    assert!(!error.contains("renew"), "another key would not help: {error}");
}
