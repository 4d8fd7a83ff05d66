//! Questions to a game, each with its deadline and its number.

use std::{net::SocketAddr, time::Duration};

use prost::Message;

use super::fault::GameFault;
use crate::{
    protocol::{Request, Response, Status, request, response},
    websocket::{Connection, WebsocketError},
};

/// A client of one game.
#[derive(Debug)]
pub(super) struct Client {
    connection: Connection,
    asked: u32,
    patience: Duration,
}

impl Client {
    /// Connects to a game that listens already.
    pub(super) fn connect(address: SocketAddr, patience: Duration) -> Result<Self, WebsocketError> {
        Ok(Self {
            connection: Connection::connect(address, patience)?,
            asked: 0,
            patience,
        })
    }

    /// Asks, waits for the answer, and checks that it is the one to this question.
    pub(super) fn ask(
        &mut self,
        kind: request::Kind,
    ) -> Result<(response::Kind, Status), GameFault> {
        let name = kind.name();
        self.asked += 1;
        let request = Request {
            kind: Some(kind),
            id: Some(self.asked),
        };
        let patience = Some(self.patience);
        let failed = |error| GameFault::of_connection(name, error);
        self.connection
            .send(&request.encode_to_vec(), patience)
            .map_err(failed)?;
        let bytes = self.connection.receive(patience).map_err(failed)?;
        let response = Response::decode(&bytes[..])
            .map_err(|error| GameFault::garbage(name, error.to_string()))?;
        self.check(name, response)
    }

    /// Asks the program to end, and does not wait.
    pub(super) fn quit(&mut self) {
        let request = Request {
            kind: Some(request::Kind::Quit(crate::protocol::RequestQuit {})),
            id: None,
        };
        // The process is killed if it does not hear.
        let _ = self
            .connection
            .send(&request.encode_to_vec(), Some(Duration::from_millis(100)));
    }

    fn check(
        &self,
        name: &'static str,
        response: Response,
    ) -> Result<(response::Kind, Status), GameFault> {
        if response.id != Some(self.asked) {
            let problem = format!("number {:?}, expected {}", response.id, self.asked);
            return Err(GameFault::garbage(name, problem));
        }
        if !response.error.is_empty() {
            return Err(GameFault::Refused {
                request: name,
                reason: response.error.join("; "),
            });
        }
        let status = response
            .status
            .and_then(|status| Status::try_from(status).ok());
        match (response.kind, status) {
            (Some(kind), Some(status)) => Ok((kind, status)),
            (None, _) => Err(GameFault::garbage(name, "no answer in the response")),
            (_, None) => Err(GameFault::garbage(name, "no status in the response")),
        }
    }
}
