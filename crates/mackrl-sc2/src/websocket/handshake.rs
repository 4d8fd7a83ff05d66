//! The exchange of HTTP heads by which a connection becomes a websocket.

use std::io::{BufRead, Read};

use tungstenite::handshake::derive_accept_key;

use super::{PATH, WebsocketError};

/// Greatest length of an HTTP head in bytes.
const HEAD_LENGTH_MAX: usize = 8 << 10;

/// What a client asks for.
pub(super) fn request(host: &str, key: &str) -> String {
    format!(
        "GET {PATH} HTTP/1.1\r\nHost: {host}\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n\
         Sec-WebSocket-Key: {key}\r\nSec-WebSocket-Version: 13\r\n\r\n"
    )
}

/// What a server answers to `head`: the response, and whether it is a consent.
pub(super) fn answer(head: &str) -> (String, bool) {
    let refusal = |status: &str| {
        (
            format!("HTTP/1.1 {status}\r\nContent-Length: 0\r\nConnection: close\r\n\r\n"),
            false,
        )
    };
    let mut words = head.lines().next().unwrap_or_default().split(' ');
    if words.next() != Some("GET") {
        return refusal("405 Method Not Allowed");
    }
    if words.next() != Some(PATH) {
        return refusal("404 Not Found");
    }
    // Browsers send it for every page, and no program of ours does: a page of any site could end the game otherwise.
    if header(head, "origin").is_some() {
        return refusal("403 Forbidden");
    }
    let upgrades =
        header(head, "upgrade").is_some_and(|value| value.eq_ignore_ascii_case("websocket"));
    let key = header(head, "sec-websocket-key").filter(|_| upgrades);
    let Some(key) = key else {
        return refusal("400 Bad Request");
    };
    if header(head, "sec-websocket-version") != Some("13") {
        return refusal("426 Upgrade Required");
    }
    let response = format!(
        "HTTP/1.1 101 Switching Protocols\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n\
         Sec-WebSocket-Accept: {}\r\n\r\n",
        derive_accept_key(key.as_bytes())
    );
    (response, true)
}

/// Whether `head` consents to the request made with `key`.
pub(super) fn check_answer(head: &str, key: &str) -> Result<(), WebsocketError> {
    let status = head.lines().next().unwrap_or_default();
    let is_switching = status.split(' ').nth(1) == Some("101");
    if is_switching
        && header(head, "sec-websocket-accept") == Some(&derive_accept_key(key.as_bytes()))
    {
        return Ok(());
    }
    let status: String = status.chars().take(80).collect();
    Err(WebsocketError::protocol(format!(
        "the server answers {status:?}"
    )))
}

/// Reads up to the empty line that ends a head.
pub(super) fn read_head(input: &mut impl BufRead) -> Result<String, WebsocketError> {
    let mut head = Vec::new();
    for byte in input.take(HEAD_LENGTH_MAX as u64).bytes() {
        head.push(byte?);
        if head.ends_with(b"\r\n\r\n") {
            return String::from_utf8(head)
                .map_err(|_| WebsocketError::protocol("an HTTP head that is not text"));
        }
    }
    if head.len() < HEAD_LENGTH_MAX {
        return Err(WebsocketError::Closed);
    }
    Err(WebsocketError::protocol(format!(
        "an HTTP head of more than {HEAD_LENGTH_MAX} bytes"
    )))
}

fn header<'a>(head: &'a str, name: &str) -> Option<&'a str> {
    head.lines().skip(1).find_map(|line| {
        let (key, value) = line.split_once(':')?;
        key.trim().eq_ignore_ascii_case(name).then(|| value.trim())
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_key_is_answered_as_in_the_example_of_the_standard() {
        assert_eq!(
            derive_accept_key(b"dGhlIHNhbXBsZSBub25jZQ=="),
            "s3pPLMBiTxaQ9kYGzzhZRbK+xOo="
        );
    }

    #[test]
    fn only_a_websocket_request_for_the_path_of_the_game_is_granted() {
        let head = request("127.0.0.1:1", "dGhlIHNhbXBsZSBub25jZQ==");
        let (response, is_granted) = answer(&head);
        assert!(is_granted, "{response}");
        check_answer(&response, "dGhlIHNhbXBsZSBub25jZQ==").unwrap();
        check_answer(&response, "another").unwrap_err();
        for (wrong, status) in [
            (head.replace("GET", "PUT"), "405"),
            (head.replace("/sc2api", "/"), "404"),
            (head.replace("Upgrade: websocket", "Upgrade: h2c"), "400"),
            (head.replace("Version: 13", "Version: 8"), "426"),
            (
                head.replace("Upgrade:", "Origin: https://evil.example\r\nUpgrade:"),
                "403",
            ),
            (String::new(), "405"),
        ] {
            let (response, is_granted) = answer(&wrong);
            assert!(!is_granted, "{wrong}");
            assert_eq!(response.split(' ').nth(1), Some(status), "{wrong}");
        }
    }
}
