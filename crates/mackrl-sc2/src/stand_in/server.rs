//! The socket of the stand-in: one client at a time, one request after the other.

use std::{
    io,
    net::{SocketAddr, TcpListener, TcpStream},
    thread,
    time::Duration,
};

use mackrl_skirmish::UnitData;
use prost::Message;
use rustix::process::{Signal, getpid, kill_process};

use super::{
    Game, ReplayWriter,
    faults::{Fault, FaultPlan},
};
use crate::{
    protocol::{Request, Response, Status},
    websocket::{Connection, WebsocketError},
};

/// How long a client may take to ask for the websocket, and to take an answer.
const PATIENCE: Duration = Duration::from_secs(30);
/// How long a client may say nothing before another may come: longer than learning between two episodes takes.
const IDLE: Duration = Duration::from_secs(3600);
/// How long a hanging server hangs: longer than anybody waits.
const FOR_EVER: Duration = Duration::from_secs(3600);

/// How a stand-in plays.
#[derive(Default)]
#[expect(
    missing_debug_implementations,
    reason = "a function that writes replays is not shown"
)]
pub struct StandInOptions {
    /// Statistics of the units.
    pub units: UnitData,
    /// Seed of games whose client names none.
    pub seed: u64,
    /// Writes replays, if they can be asked for.
    pub replays: Option<ReplayWriter>,
    /// Misbehaves on purpose.
    pub faults: Option<FaultPlan>,
}

/// A server that is taken for StarCraft II.
#[derive(Debug)]
pub struct StandIn {
    listener: TcpListener,
    game: Game,
    faults: Option<FaultPlan>,
}

/// What a client left behind.
#[derive(Debug, PartialEq, Eq)]
enum After {
    /// Another client may come.
    Wait,
    /// It asked the program to end.
    Quit,
}

impl StandIn {
    /// Listens at `address`.
    ///
    /// # Errors
    /// If the address is not one of this machine alone, or the port is occupied.
    pub fn bind(address: SocketAddr, options: StandInOptions) -> io::Result<Self> {
        if !address.ip().is_loopback() {
            let message = format!(
                "{} can be reached from other machines, expected 127.0.0.1 or ::1",
                address.ip()
            );
            return Err(io::Error::new(io::ErrorKind::InvalidInput, message));
        }
        let mut faults = options.faults;
        if faults.as_mut().is_some_and(FaultPlan::is_port_occupied) {
            return Err(io::ErrorKind::AddrInUse.into());
        }
        Ok(Self {
            listener: TcpListener::bind(address)?,
            game: Game::new(options.units, options.seed, options.replays),
            faults,
        })
    }

    /// Where clients have to connect to.
    ///
    /// # Errors
    /// What the operating system says.
    pub fn address(&self) -> io::Result<SocketAddr> {
        self.listener.local_addr()
    }

    /// Answers one client after the other, until one asks the program to end. `report` hears what ended a connection.
    ///
    /// # Errors
    /// If no more clients can be accepted.
    pub fn serve(mut self, mut report: impl FnMut(&WebsocketError)) -> io::Result<()> {
        loop {
            let (stream, _) = self.listener.accept()?;
            match self.serve_client(stream) {
                Ok(After::Quit) => return Ok(()),
                Ok(After::Wait) => {}
                Err(error) => report(&error),
            }
        }
    }

    fn serve_client(&mut self, stream: TcpStream) -> Result<After, WebsocketError> {
        let mut connection = Connection::accept(stream, PATIENCE)?;
        loop {
            let message = match connection.receive(Some(IDLE)) {
                Err(WebsocketError::Closed) => return Ok(After::Wait),
                message => message?,
            };
            let mut response = match Request::decode(&message[..]) {
                Ok(request) => self.game.answer(&request),
                Err(_) => self.game.answer_garbage(),
            };
            let fault = self.faults.as_mut().and_then(FaultPlan::draw_fault);
            if fault == Some(Fault::Refuse) {
                response = Response {
                    kind: None,
                    error: vec!["refused on purpose".to_owned()],
                    ..response
                };
            }
            let answer = response.encode_to_vec();
            if let Some(fault) = fault {
                self.misbehave(fault, &answer, &mut connection)?;
            }
            if fault != Some(Fault::Garbage) {
                connection.send(&answer, Some(PATIENCE))?;
            }
            if self.game.status() == Status::Quit {
                return Ok(After::Quit);
            }
        }
    }

    fn misbehave(
        &mut self,
        fault: Fault,
        answer: &[u8],
        connection: &mut Connection,
    ) -> Result<(), WebsocketError> {
        let Some(plan) = &mut self.faults else {
            return Ok(());
        };
        match fault {
            Fault::Hang => thread::sleep(FOR_EVER),
            Fault::Late => thread::sleep(plan.late),
            Fault::Close => return Err(WebsocketError::Closed),
            Fault::Twice => connection.send(answer, Some(PATIENCE))?,
            Fault::Garbage => {
                let garbage = plan.garbage(answer);
                connection.send(&garbage, Some(PATIENCE))?;
            }
            // A process that cannot signal itself goes on, and the test that counts faults notices.
            Fault::Stop => drop(kill_process(getpid(), Signal::STOP)),
            Fault::Kill => drop(kill_process(getpid(), Signal::KILL)),
            Fault::Refuse | Fault::Port => {}
        }
        Ok(())
    }
}
