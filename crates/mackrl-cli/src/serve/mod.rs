//! Runs in the browser, on this machine alone, updating as they go.
//!
//! A small server of our own on the standard library: it binds the loopback interface, answers GET, reads a bounded head of
//! a request and never a body, and refuses hosts other than this machine's, so that no page of another site can read along. It
//! only reads run folders. A web framework would bring a hundred crates for five addresses.

mod http;
mod runs;

use std::{
    net::{Ipv4Addr, TcpListener, TcpStream},
    path::PathBuf,
    sync::{
        Arc,
        atomic::{AtomicUsize, Ordering},
    },
    time::Duration,
};

use anyhow::Context;

use crate::{
    output,
    replay::Opened,
    serve::{
        http::{Request, Response},
        runs::Served,
    },
};

const PAGE: &str = include_str!("page.html");
/// Longest that a browser may take to ask or to listen.
const PATIENCE: Duration = Duration::from_secs(10);
/// Between a connection that could not be accepted and the next attempt.
const RECOVERY: Duration = Duration::from_millis(20);
/// Most connections at once.
const CONNECTIONS_MOST: usize = 32;

/// Serves the runs in `folders` until the program is stopped; port 0 takes any that is free.
///
/// # Errors
/// If the port cannot be had.
pub(crate) fn serve(folders: &[PathBuf], port: u16) -> anyhow::Result<()> {
    let listener = TcpListener::bind((Ipv4Addr::LOCALHOST, port))
        .with_context(|| format!("cannot listen on 127.0.0.1:{port}"))?;
    let port = listener
        .local_addr()
        .context("a listener has a port")?
        .port();
    output::print(&format!("http://127.0.0.1:{port}/\n"))?;
    let served = Arc::new(Served::new(folders));
    let connections = Arc::new(AtomicUsize::new(0));
    for stream in listener.incoming() {
        let Ok(stream) = stream else {
            // A connection that is gone already costs nothing; without free descriptors, asking again at once would spin.
            std::thread::sleep(RECOVERY);
            continue;
        };
        let Some(slot) = Slot::take(&connections) else {
            continue;
        };
        let served = Arc::clone(&served);
        std::thread::spawn(move || {
            let _slot = slot;
            // A browser that hangs up loses its own answer alone.
            let _ = answer(&stream, &served, port);
        });
    }
    Ok(())
}

/// One of the connections that may be open at once; given back when it is dropped, also by a panic.
struct Slot(Arc<AtomicUsize>);

impl Slot {
    /// Takes one, if there is one.
    fn take(connections: &Arc<AtomicUsize>) -> Option<Self> {
        let more = |open| (open < CONNECTIONS_MOST).then_some(open + 1);
        let taken = connections.fetch_update(Ordering::Relaxed, Ordering::Relaxed, more);
        taken.is_ok().then(|| Self(Arc::clone(connections)))
    }
}

impl Drop for Slot {
    fn drop(&mut self) {
        self.0.fetch_sub(1, Ordering::Relaxed);
    }
}

fn answer(stream: &TcpStream, served: &Served, port: u16) -> std::io::Result<()> {
    stream.set_read_timeout(Some(PATIENCE))?;
    stream.set_write_timeout(Some(PATIENCE))?;
    let response = match Request::read(stream) {
        Ok(request) if !request.is_for(port) => Response::error(403, "only this machine is served"),
        Ok(request) => route(&request.path, served),
        Err(refusal) => refusal,
    };
    response.write(stream)
}

/// What stands at an address.
fn route(path: &str, served: &Served) -> Response {
    let (path, query) = path.split_once('?').unwrap_or((path, ""));
    let parts: Vec<&str> = path.trim_matches('/').split('/').collect();
    match parts[..] {
        [""] => Response::html(PAGE.as_bytes().to_vec()),
        ["runs.json"] => Response::json(&served.list()),
        ["runs", run, "metrics.jsonl"] => {
            let from = query.strip_prefix("from=").unwrap_or("0");
            let rows = from.parse().ok().and_then(|from| served.metrics(run, from));
            rows.map_or_else(Response::missing, Response::text)
        }
        ["runs", run, "replays", file] => match served.replay(run, file) {
            Some(path) => replay(&path),
            None => Response::missing(),
        },
        _ => Response::missing(),
    }
}

fn replay(path: &std::path::Path) -> Response {
    let written = Opened::read(path).map(|opened| opened.page(0));
    match written {
        Ok(page) => Response::html(page.into_bytes()),
        Err(error) => Response::error(500, &format!("{error:#}")),
    }
}

#[cfg(test)]
mod tests;
