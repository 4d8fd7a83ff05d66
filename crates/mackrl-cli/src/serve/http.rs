//! As much of HTTP as a browser on the same machine needs.

use std::io::{Read, Result, Write};

use serde::Serialize;

/// Most bytes of a request's head.
const HEAD_MOST: usize = 8 << 10;

/// What a browser asks for.
#[derive(Debug, PartialEq, Eq)]
pub(super) struct Request {
    /// Path and query.
    pub(super) path: String,
    host: String,
}

/// What it gets.
#[derive(Debug, PartialEq, Eq)]
pub(super) struct Response {
    status: u16,
    kind: &'static str,
    body: Vec<u8>,
}

impl Request {
    /// Reads the head of a request.
    ///
    /// # Errors
    /// The answer to what is no request that can be served.
    pub(super) fn read(mut stream: impl Read) -> std::result::Result<Self, Response> {
        let mut head = Vec::new();
        let mut buffer = [0; 1024];
        while !head.windows(4).any(|end| end == b"\r\n\r\n") {
            let count = stream
                .read(&mut buffer)
                .map_err(|_| Response::error(408, "the request took too long"))?;
            if count == 0 {
                return Err(Response::error(400, "the request ends within its head"));
            }
            head.extend(&buffer[..count]);
            if head.len() > HEAD_MOST {
                return Err(Response::error(431, "the request's head is too long"));
            }
        }
        let head = String::from_utf8_lossy(&head);
        let mut lines = head.lines();
        let mut words = lines.next().unwrap_or_default().split(' ');
        let (method, path) = (words.next(), words.next());
        if method != Some("GET") {
            return Err(Response::error(405, "only GET is answered"));
        }
        let host = lines.find_map(|line| {
            let (name, value) = line.split_once(':')?;
            name.eq_ignore_ascii_case("host")
                .then(|| value.trim().to_owned())
        });
        Ok(Self {
            path: path.unwrap_or_default().to_owned(),
            host: host.unwrap_or_default(),
        })
    }

    /// Whether it was sent to this machine by its own name: a page of another site, whose name was pointed here, sends that name.
    pub(super) fn is_for(&self, port: u16) -> bool {
        ["127.0.0.1", "localhost"]
            .iter()
            .any(|name| self.host == format!("{name}:{port}"))
    }
}

impl Response {
    pub(super) const fn html(body: Vec<u8>) -> Self {
        Self {
            status: 200,
            kind: "text/html; charset=utf-8",
            body,
        }
    }

    pub(super) const fn text(body: Vec<u8>) -> Self {
        Self {
            status: 200,
            kind: "text/plain; charset=utf-8",
            body,
        }
    }

    pub(super) fn json(value: &impl Serialize) -> Self {
        match serde_json::to_vec(value) {
            Ok(body) => Self {
                status: 200,
                kind: "application/json",
                body,
            },
            Err(error) => Self::error(500, &error.to_string()),
        }
    }

    pub(super) fn missing() -> Self {
        Self::error(404, "nothing is there")
    }

    /// An answer to what cannot be served.
    pub(super) fn error(status: u16, message: &str) -> Self {
        Self {
            status,
            kind: "text/plain; charset=utf-8",
            body: format!("{message}\n").into_bytes(),
        }
    }

    /// Sends it, and tells the browser to keep nothing and to trust no guess at what it is.
    pub(super) fn write(&self, mut stream: impl Write) -> Result<()> {
        let head = format!(
            "HTTP/1.1 {} {}\r\nContent-Type: {}\r\nContent-Length: {}\r\nCache-Control: no-store\r\n\
             X-Content-Type-Options: nosniff\r\nReferrer-Policy: no-referrer\r\nConnection: close\r\n\r\n",
            self.status,
            if self.status == 200 { "OK" } else { "Refused" },
            self.kind,
            self.body.len(),
        );
        stream.write_all(head.as_bytes())?;
        stream.write_all(&self.body)?;
        stream.flush()
    }

    #[cfg(test)]
    pub(super) const fn status(&self) -> u16 {
        self.status
    }

    #[cfg(test)]
    pub(super) fn body(&self) -> String {
        String::from_utf8_lossy(&self.body).into_owned()
    }
}
