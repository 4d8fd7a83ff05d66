//! Runs in the browser, on this machine alone, updating as they go.
//!
//! It binds the loopback interface, wants the token that stands in the address which it prints, answers GET, and refuses hosts other
//! than this machine's. Run folders are only read, through one guard: no link is followed, nothing blocks. Every request has a
//! deadline, and what is too much at once is refused with 503 rather than left to wait.

mod answer;
mod runs;

use std::{convert::Infallible, net::Ipv4Addr, path::PathBuf, sync::Arc, time::Duration};

use anyhow::Context;
use http_body_util::Full;
use hyper::{
    Method, Request, Response,
    body::{Bytes, Incoming},
    server::conn::http1,
    service::service_fn,
};
use hyper_util::rt::{TokioIo, TokioTimer};
use tokio::{
    net::{TcpListener, TcpStream},
    runtime,
    sync::Semaphore,
    time::timeout,
};

use self::{
    answer::{Answer, route},
    runs::Served,
};
use crate::output;

/// Longest that a browser may take to ask.
const TO_ASK: Duration = Duration::from_secs(5);
/// Longest that an answer may take to be found.
const TO_ANSWER: Duration = Duration::from_secs(5);
/// Longest that a connection may last.
const TO_END: Duration = Duration::from_secs(20);
/// Between a connection that could not be accepted and the next attempt.
const RECOVERY: Duration = Duration::from_millis(20);
/// Most connections at once.
const CONNECTIONS_MOST: usize = 256;
/// Most answers that are looked for at once.
const ANSWERS_MOST: usize = 8;
/// Most bytes of a request's head.
const HEAD_MOST: usize = 16 << 10;
/// What is sent to a connection that is one too many.
const SHED: &[u8] =
    b"HTTP/1.1 503 Service Unavailable\r\nContent-Length: 0\r\nConnection: close\r\n\r\n";

/// What all connections share.
struct Shared {
    served: Served,
    token: String,
    port: u16,
    answers: Semaphore,
}

/// Serves the runs in `folders` until the program is stopped; port 0 takes any that is free.
///
/// # Errors
/// If the port cannot be had.
pub(crate) fn serve(folders: &[PathBuf], port: u16) -> anyhow::Result<()> {
    let runtime = runtime::Builder::new_current_thread()
        .enable_io()
        .enable_time()
        .max_blocking_threads(ANSWERS_MOST)
        .build()
        .context("cannot start a web server")?;
    runtime.block_on(accept_all(folders, port))
}

async fn accept_all(folders: &[PathBuf], port: u16) -> anyhow::Result<()> {
    let listener = TcpListener::bind((Ipv4Addr::LOCALHOST, port))
        .await
        .with_context(|| format!("cannot listen on 127.0.0.1:{port}"))?;
    let port = listener
        .local_addr()
        .context("a listener has a port")?
        .port();
    let shared = Arc::new(Shared {
        served: Served::new(folders),
        token: token()?,
        port,
        answers: Semaphore::new(ANSWERS_MOST),
    });
    output::print(&format!("http://127.0.0.1:{port}/{}/\n", shared.token))?;
    accept_on(listener, shared).await;
    Ok(())
}

/// Accepts connections until the program is stopped.
async fn accept_on(listener: TcpListener, shared: Arc<Shared>) {
    let connections = Arc::new(Semaphore::new(CONNECTIONS_MOST));
    loop {
        let Ok((stream, _)) = listener.accept().await else {
            // A connection that is gone already costs nothing; without free descriptors, asking again at once would spin.
            tokio::time::sleep(RECOVERY).await;
            continue;
        };
        let Ok(slot) = Arc::clone(&connections).try_acquire_owned() else {
            tokio::spawn(async move {
                // One that does not take it loses nothing but its own answer.
                if let Ok(Ok(())) = timeout(RECOVERY, stream.writable()).await {
                    let _ = stream.try_write(SHED);
                }
            });
            continue;
        };
        let shared = Arc::clone(&shared);
        tokio::spawn(async move {
            let _slot = slot;
            // A browser that hangs up loses its own answer alone.
            let _ = timeout(TO_END, converse(stream, shared)).await;
        });
    }
}

/// Answers what is asked on one connection.
async fn converse(stream: TcpStream, shared: Arc<Shared>) -> hyper::Result<()> {
    let service = service_fn(move |request| {
        let shared = Arc::clone(&shared);
        async move { Ok::<_, Infallible>(respond(&request, shared).await) }
    });
    http1::Builder::new()
        .timer(TokioTimer::new())
        .header_read_timeout(TO_ASK)
        .max_buf_size(HEAD_MOST)
        .keep_alive(false)
        .serve_connection(TokioIo::new(stream), service)
        .await
}

async fn respond(request: &Request<Incoming>, shared: Arc<Shared>) -> Response<Full<Bytes>> {
    if request.method() != Method::GET {
        return Answer::refusal(405, "only GET is answered").into_response();
    }
    let host = request.headers().get(hyper::header::HOST);
    if !is_own_name(host.and_then(|host| host.to_str().ok()), shared.port) {
        return Answer::refusal(403, "only this machine is served").into_response();
    }
    let path = request.uri().path().to_owned();
    let query = request.uri().query().unwrap_or_default().to_owned();
    let Ok(_permit) = shared.answers.try_acquire() else {
        return Answer::refusal(503, "too much is asked for at once").into_response();
    };
    let asked = Arc::clone(&shared);
    let found = tokio::task::spawn_blocking(move || {
        // The token comes first: without it nothing is there.
        match path.trim_start_matches('/').split_once('/') {
            Some((token, rest)) if token == asked.token => route(rest, &query, &asked.served),
            _ => Answer::refusal(403, "the address that `mackrl serve` printed has a token"),
        }
    });
    let answer = match timeout(TO_ANSWER, found).await {
        Ok(Ok(answer)) => answer,
        Ok(Err(_)) => Answer::refusal(500, "a defect of this program"),
        Err(_) => Answer::refusal(503, "it took too long"),
    };
    answer.into_response()
}

/// Whether a request was sent to this machine by its own name: a page of another site, whose name was pointed here, sends that name.
fn is_own_name(host: Option<&str>, port: u16) -> bool {
    let names = ["127.0.0.1", "localhost"];
    names
        .iter()
        .any(|name| host == Some(&format!("{name}:{port}")))
}

/// 128 random bits: other users of the machine, and other sites' pages, do not know them.
fn token() -> anyhow::Result<String> {
    let mut bytes = [0; 16];
    getrandom::fill(&mut bytes)
        .map_err(std::io::Error::other)
        .context("cannot draw a token")?;
    Ok(mackrl_run::provenance::hexadecimal(&bytes))
}

#[cfg(test)]
mod tests;
