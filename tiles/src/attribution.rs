//! Whom an archive names as its authors.

/// An attribution as one line of text; archives have it as HTML.
pub(crate) fn shorten_attribution(text: &str) -> Option<String> {
    let mut plain = String::new();
    let mut is_tag = false;
    for letter in text.chars().take(2_000) {
        match letter {
            '<' => is_tag = true,
            '>' => is_tag = false,
            _ if is_tag => {}
            _ if letter.is_control() => plain.push(' '),
            _ => plain.push(letter),
        }
    }
    let plain = plain.replace("&copy;", "©").replace("&amp;", "&");
    let line = plain.split_whitespace().collect::<Vec<_>>().join(" ");
    let short: String = line.chars().take(200).collect();
    (!short.is_empty()).then_some(short)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn html_becomes_one_line() {
        let html = "<a href=\"https://x\">&copy; Open\nMap</a> &amp; others ";
        assert_eq!(shorten_attribution(html).as_deref(), Some("© Open Map & others"));
        assert_eq!(shorten_attribution("<b></b>"), None);
        assert_eq!(shorten_attribution(&"a".repeat(5_000)).map(|it| it.len()), Some(200));
    }
}
