use super::*;

const NOW_S: i64 = 1_800_000_000;
const HOUR_S: i64 = 3600;

fn secret(number: u8) -> Secret {
    Secret::new([number; SECRET_LEN])
}

fn order(name: &str, devices: u32) -> InvitationOrder {
    InvitationOrder { name: name.into(), role: KeyRole::Operator, for_s: HOUR_S, devices }
}

/// One invitation of alice for two browsers, with the secret 1.
fn alice() -> Invitations {
    let mut all = Invitations::default();
    all.invite(&order("alice", 2), &secret(1), NOW_S).expect("it is made");
    all
}

#[test]
fn a_link_admits_the_browsers_that_it_is_for_and_no_more() {
    let mut all = alice();
    for session in [2, 3] {
        let visitor =
            all.redeem(&secret(1), &secret(session), None, NOW_S + 1).expect("it is accepted");
        assert_eq!((visitor.name.as_str(), visitor.role), ("alice", KeyRole::Operator));
        assert_eq!(all.find_visitor(&secret(session), NOW_S + 2), Ok(visitor));
    }
    assert_eq!(all.redeem(&secret(1), &secret(4), None, NOW_S + 3), Err(AccessFault::Used));
    assert_eq!(all.find_visitor(&secret(4), NOW_S + 3), Err(AccessFault::Unknown));
    all.log_out(&secret(2));
    assert_eq!(all.find_visitor(&secret(2), NOW_S + 3), Err(AccessFault::Unknown));
    assert!(all.find_visitor(&secret(3), NOW_S + 3).is_ok(), "another browser stays");
    assert_eq!(all.redeem(&secret(1), &secret(4), None, NOW_S + 3), Err(AccessFault::Used));
}

#[test]
fn a_browser_that_got_no_answer_uses_no_second_place_and_no_other_browser_can_repeat_it() {
    let mut all = Invitations::default();
    all.invite(&order("alice", 1), &secret(1), NOW_S).expect("it is made");
    let mut redeem = |session, attempt: Option<u8>, at_s| {
        let attempt = attempt.map(secret);
        all.redeem(&secret(1), &secret(session), attempt.as_ref(), at_s)
    };
    redeem(2, Some(9), NOW_S).expect("it is accepted, and its answer is lost");
    for other in [None, Some(8)] {
        assert_eq!(redeem(3, other, NOW_S + 1), Err(AccessFault::Used), "another browser");
    }
    redeem(4, Some(9), NOW_S + REPEATED_WITHIN_S).expect("the same browser, again");
    assert_eq!(redeem(5, Some(9), NOW_S + REPEATED_WITHIN_S + 1), Err(AccessFault::Used), "late");
    assert_eq!((all.list()[0].used, all.count_sessions(1)), (1, 1));
    assert_eq!(all.find_visitor(&secret(2), NOW_S + 1), Err(AccessFault::Unknown), "was replaced");
    assert!(all.find_visitor(&secret(4), NOW_S + 1).is_ok());
}

#[test]
fn an_attempt_is_of_one_invitation_survives_a_restart_and_ends_with_its_session() {
    let mut all = alice();
    all.invite(&order("bob", 1), &secret(6), NOW_S).expect("bob's");
    all.redeem(&secret(6), &secret(7), Some(&secret(9)), NOW_S).expect("bob logs in");
    all.redeem(&secret(1), &secret(2), Some(&secret(9)), NOW_S).expect("a place of alice's");
    assert_eq!(all.find_visitor(&secret(7), NOW_S).map(|it| it.name), Ok("bob".into()));
    let text = all.to_text();
    assert!(!text.contains(&secret(9).to_text()), "{text}");
    let mut all = Invitations::from_text(&text).expect("it is read");
    assert_eq!(all.to_text(), text);
    all.redeem(&secret(6), &secret(8), Some(&secret(9)), NOW_S + 9).expect("the same browser");
    all.log_out(&secret(8));
    let again = all.redeem(&secret(6), &secret(5), Some(&secret(9)), NOW_S + 9);
    assert_eq!(again, Err(AccessFault::Used), "a log-out gives nothing back");
}

#[test]
fn the_end_of_an_invitation_ends_its_link_and_its_sessions() {
    let mut all = alice();
    all.redeem(&secret(1), &secret(2), None, NOW_S).expect("it is accepted");
    for (at_s, expected) in [
        (NOW_S - CLOCK_MARGIN_S - 1, Some(AccessFault::Later)),
        (NOW_S - CLOCK_MARGIN_S, None),
        (NOW_S + HOUR_S - 1, None),
        (NOW_S + HOUR_S, Some(AccessFault::Expired { at_s: NOW_S + HOUR_S })),
        (i64::MAX, Some(AccessFault::Expired { at_s: NOW_S + HOUR_S })),
    ] {
        assert_eq!(all.find_visitor(&secret(2), at_s).err(), expected, "at {at_s}");
        let mut again = all.clone();
        assert_eq!(again.redeem(&secret(1), &secret(3), None, at_s).err(), expected, "at {at_s}");
    }
}

#[test]
fn a_revocation_ends_all_invitations_of_the_name_and_no_other() {
    let mut all = alice();
    all.invite(&order("alice", 1), &secret(5), NOW_S).expect("another one");
    all.invite(&order("bob", 1), &secret(6), NOW_S).expect("bob's");
    for (link, session) in [(1, 2), (5, 7), (6, 8)] {
        all.redeem(&secret(link), &secret(session), None, NOW_S).expect("it is accepted");
    }
    assert_eq!(all.revoke("alice", NOW_S), 2);
    assert_eq!(all.revoke("alice", NOW_S), 0, "they are revoked already");
    for session in [2, 7] {
        assert_eq!(all.find_visitor(&secret(session), NOW_S), Err(AccessFault::Revoked));
    }
    assert_eq!(all.redeem(&secret(1), &secret(3), None, NOW_S), Err(AccessFault::Revoked));
    assert!(all.find_visitor(&secret(8), NOW_S).is_ok());
}

#[test]
fn what_is_written_is_read_back_and_has_no_secret() {
    let mut all = alice();
    all.invite(&order("bob", 1), &secret(6), NOW_S).expect("bob's");
    all.redeem(&secret(1), &secret(2), None, NOW_S).expect("it is accepted");
    all.revoke("bob", NOW_S);
    let text = all.to_text();
    let read = Invitations::from_text(&text).expect("it is read");
    assert_eq!(read.to_text(), text);
    assert_eq!(read.find_visitor(&secret(2), NOW_S), all.find_visitor(&secret(2), NOW_S));
    for number in [1, 2, 6] {
        assert!(!text.contains(&secret(number).to_text()), "{text}");
    }
    assert_eq!(format!("{:?}", secret(1)), "Secret(…)");
}

#[test]
fn another_file_is_refused_with_its_line() {
    let good = alice().to_text();
    let line = good.lines().nth(1).expect("the invitation").to_owned();
    for (bad, at) in [
        ("x".to_owned(), 1),
        (format!("# a\n{line} more"), 2),
        (line.replace("alice", "al/ice"), 1),
        (line.replace("operator", "host"), 1),
        (line.replace("given", "maybe"), 1),
        (line[..line.len() - 1].to_owned(), 1),
        ("session 1 2".to_owned(), 1),
        ("session 1 2 zz".to_owned(), 1),
        (format!("session 1 2 {} zz", "0".repeat(64)), 1),
        (format!("session 1 2 {0} {0} {0}", "0".repeat(64)), 1),
    ] {
        let error = Invitations::from_text(&bad).expect_err(&bad);
        assert!(error.contains(&format!("line {at} ")), "{error}: {bad}");
    }
    assert!(Invitations::from_text("").expect("an empty file").list().is_empty());
}

#[test]
fn a_secret_is_read_back_and_nothing_else_is_one() {
    let text = secret(0xa5).to_text();
    assert_eq!(text.len(), 2 * SECRET_LEN);
    assert!(Secret::from_text(&text) == Some(secret(0xa5)));
    let short = &text[1..];
    for text in ["", short, &format!("{text}0"), &"é".repeat(SECRET_LEN), &"g".repeat(40)] {
        assert!(Secret::from_text(text).is_none(), "{text}");
    }
}

#[test]
fn a_wrong_order_is_refused_and_ended_invitations_make_room() {
    let mut all = Invitations::default();
    for (name, for_s, devices) in [
        ("", 60, 1),
        ("al ice", 60, 1),
        ("a", 0, 1),
        ("a", LONGEST_S + 1, 1),
        ("a", 60, 0),
        ("a", 60, 17),
    ] {
        let order = InvitationOrder { name: name.into(), role: KeyRole::Observer, for_s, devices };
        assert!(all.invite(&order, &secret(1), NOW_S).is_err(), "{order:?}");
    }
    for _ in 0..MAX_INVITATIONS {
        all.invite(&order("alice", 1), &secret(1), NOW_S).expect("there is room");
    }
    let error = all.invite(&order("bob", 1), &secret(2), NOW_S).expect_err("no room");
    assert!(error.contains("armor keys revoke"), "{error}");
    let later_s = NOW_S + HOUR_S;
    all.invite(&order("bob", 1), &secret(2), later_s).expect("those that ended are removed");
    assert_eq!(all.list().len(), 1);
    assert!(all.redeem(&secret(2), &secret(3), None, later_s).is_ok());
}
