//! What stands at an address.

use http_body_util::Full;
use hyper::{
    Response,
    body::Bytes,
    header::{CACHE_CONTROL, CONTENT_TYPE, HeaderValue, REFERRER_POLICY, X_CONTENT_TYPE_OPTIONS},
};
use mackrl_run::replay::Replay;
use serde::Serialize;

use super::runs::Served;
use crate::replay::Opened;

const PAGE: [&str; 7] = [
    include_str!("page.html"),
    "<style>",
    include_str!("uplot/uPlot.min.css"),
    "</style><script>",
    include_str!("uplot/uPlot.iife.min.js"),
    include_str!("page.js"),
    "</script></body></html>",
];

/// What a browser gets.
#[derive(Debug, PartialEq, Eq)]
pub(super) struct Answer {
    status: u16,
    kind: &'static str,
    body: Vec<u8>,
}

impl Answer {
    const fn new(kind: &'static str, body: Vec<u8>) -> Self {
        Self {
            status: 200,
            kind,
            body,
        }
    }

    fn json(value: &impl Serialize) -> Self {
        match serde_json::to_vec(value) {
            Ok(body) => Self::new("application/json", body),
            Err(error) => Self::refusal(500, &error.to_string()),
        }
    }

    /// An answer to what cannot be served.
    pub(super) fn refusal(status: u16, message: &str) -> Self {
        Self {
            status,
            kind: "text/plain; charset=utf-8",
            body: format!("{message}\n").into_bytes(),
        }
    }

    /// With headers that tell the browser to keep nothing, to trust no guess at what it is, and to tell no other site the address.
    pub(super) fn into_response(self) -> Response<Full<Bytes>> {
        let mut response = Response::new(Full::new(Bytes::from(self.body)));
        *response.status_mut() =
            (self.status.try_into()).unwrap_or(hyper::StatusCode::INTERNAL_SERVER_ERROR);
        let headers = response.headers_mut();
        headers.insert(CONTENT_TYPE, HeaderValue::from_static(self.kind));
        headers.insert(CACHE_CONTROL, HeaderValue::from_static("no-store"));
        headers.insert(X_CONTENT_TYPE_OPTIONS, HeaderValue::from_static("nosniff"));
        headers.insert(REFERRER_POLICY, HeaderValue::from_static("no-referrer"));
        response
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

/// What stands at an address, after its token.
pub(super) fn route(path: &str, query: &str, served: &Served) -> Answer {
    let missing = || Answer::refusal(404, "nothing is there");
    let parts: Vec<&str> = path.split('/').collect();
    match parts[..] {
        [""] => Answer::new("text/html; charset=utf-8", PAGE.concat().into_bytes()),
        ["runs.json"] => Answer::json(&served.list()),
        ["runs", run, "rows.json"] => {
            let from = query.strip_prefix("from=").unwrap_or("0");
            let rows = from.parse().ok().and_then(|from| served.rows(run, from));
            rows.map_or_else(missing, |rows| Answer::json(&rows))
        }
        ["runs", run, "replays", file] => {
            let bytes = served.replay(run, file, Replay::FILE_MOST);
            bytes.map_or_else(missing, |bytes| replay(&bytes))
        }
        _ => missing(),
    }
}

fn replay(bytes: &[u8]) -> Answer {
    let written = Opened::from_bytes(bytes).map(|opened| opened.page(0));
    match written {
        Ok(page) => Answer::new("text/html; charset=utf-8", page.into_bytes()),
        Err(error) => Answer::refusal(500, &format!("{error:#}")),
    }
}
