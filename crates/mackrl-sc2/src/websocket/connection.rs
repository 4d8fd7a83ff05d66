//! One open websocket.

use std::{
    hash::{BuildHasher, RandomState},
    io::{self, BufReader, Read, Write},
    net::{SocketAddr, TcpStream},
    time::{Duration, Instant},
};

use super::{
    MESSAGE_LENGTH_MAX, WebsocketError,
    frame::{self, Opcode},
    handshake,
};

/// An open websocket on which whole messages are sent and received.
///
/// After an error the connection is of no more use: a message may have been cut in two.
#[derive(Debug)]
pub struct Connection {
    input: BufReader<Timed>,
    is_client: bool,
    /// Source of masks, which only have to differ.
    masks: (RandomState, u64),
}

/// A socket whose reads and writes end by a deadline.
#[derive(Debug)]
struct Timed {
    stream: TcpStream,
    deadline: Option<(Instant, Duration)>,
}

impl Connection {
    /// Connects to the game at `address` within `patience`.
    ///
    /// # Errors
    /// If nobody listens there, or it is no game.
    pub fn connect(address: SocketAddr, patience: Duration) -> Result<Self, WebsocketError> {
        let stream = TcpStream::connect_timeout(&address, patience)?;
        let mut connection = Self::new(stream, true)?;
        connection.wait_at_most(Some(patience));
        let mut nonce = [0; 16];
        nonce[..8].copy_from_slice(&connection.random().to_le_bytes());
        nonce[8..].copy_from_slice(&connection.random().to_le_bytes());
        let key = handshake::key(nonce);
        connection.write(handshake::request(&address.to_string(), &key).as_bytes())?;
        let head = handshake::read_head(&mut connection.input).map_err(name_lateness(patience))?;
        handshake::check_answer(&head, &key)?;
        Ok(connection)
    }

    /// Answers a client that has connected, within `patience`.
    ///
    /// # Errors
    /// If it does not ask for the game's websocket; it has been told then.
    pub fn accept(stream: TcpStream, patience: Duration) -> Result<Self, WebsocketError> {
        let mut connection = Self::new(stream, false)?;
        connection.wait_at_most(Some(patience));
        let head = handshake::read_head(&mut connection.input).map_err(name_lateness(patience))?;
        let (response, is_granted) = handshake::answer(&head);
        connection.write(response.as_bytes())?;
        if is_granted {
            Ok(connection)
        } else {
            Err(WebsocketError::protocol(format!(
                "a client asked for something else: {:?}",
                head.lines()
                    .next()
                    .unwrap_or_default()
                    .chars()
                    .take(80)
                    .collect::<String>()
            )))
        }
    }

    /// Sends one message of bytes within `patience`.
    ///
    /// # Errors
    /// If the peer is gone or does not read.
    pub fn send(
        &mut self,
        message: &[u8],
        patience: Option<Duration>,
    ) -> Result<(), WebsocketError> {
        self.wait_at_most(patience);
        self.send_frame(Opcode::Binary, message)
    }

    /// Receives one message, however it is marked; waits for ever without `patience`. Pings are answered on the way.
    ///
    /// # Errors
    /// If the peer is late, has closed the connection, or breaks the protocol.
    pub fn receive(&mut self, patience: Option<Duration>) -> Result<Vec<u8>, WebsocketError> {
        self.wait_at_most(patience);
        let late = name_lateness(patience.unwrap_or_default());
        self.receive_message().map_err(late)
    }

    /// Sends bytes as they are, whatever they mean to the peer.
    #[cfg(test)]
    pub(super) fn send_unframed(&mut self, bytes: &[u8]) -> Result<(), WebsocketError> {
        self.write(bytes)
    }

    fn new(stream: TcpStream, is_client: bool) -> Result<Self, WebsocketError> {
        stream.set_nodelay(true)?;
        Ok(Self {
            input: BufReader::new(Timed {
                stream,
                deadline: None,
            }),
            is_client,
            masks: (RandomState::new(), 0),
        })
    }

    fn wait_at_most(&mut self, patience: Option<Duration>) {
        let deadline = patience.map(|patience| (Instant::now() + patience, patience));
        self.input.get_mut().deadline = deadline;
    }

    fn receive_message(&mut self) -> Result<Vec<u8>, WebsocketError> {
        let mut message: Option<Vec<u8>> = None;
        loop {
            let room = MESSAGE_LENGTH_MAX - message.as_ref().map_or(0, Vec::len);
            let frame = frame::read(&mut self.input, !self.is_client, room)?;
            match (frame.opcode, &mut message) {
                (Opcode::Close, _) => {
                    // The peer may have gone already; it is the end either way.
                    let _ = self.send_frame(Opcode::Close, &[]);
                    return Err(WebsocketError::Closed);
                }
                (Opcode::Ping, _) => {
                    self.send_frame(Opcode::Pong, &frame.payload)?;
                    continue;
                }
                (Opcode::Pong, _) => continue,
                (Opcode::Continuation, Some(message)) => message.extend(frame.payload),
                (Opcode::Text | Opcode::Binary, None) => message = Some(frame.payload),
                (Opcode::Continuation, None) => {
                    return Err(WebsocketError::protocol(
                        "a message that begins in its middle",
                    ));
                }
                (Opcode::Text | Opcode::Binary, Some(_)) => {
                    return Err(WebsocketError::protocol("a message within a message"));
                }
            }
            if frame.is_final {
                return Ok(message.unwrap_or_default());
            }
        }
    }

    fn send_frame(&mut self, opcode: Opcode, payload: &[u8]) -> Result<(), WebsocketError> {
        let mask = self.is_client.then(|| {
            let [a, b, c, d, ..] = self.random().to_le_bytes();
            [a, b, c, d]
        });
        self.write(&frame::encode(opcode, payload, mask))
    }

    fn write(&mut self, bytes: &[u8]) -> Result<(), WebsocketError> {
        let patience = self
            .input
            .get_ref()
            .deadline
            .map_or(Duration::ZERO, |(_, patience)| patience);
        let timed = self.input.get_mut();
        timed
            .write_all(bytes)
            .map_err(|error| name_lateness(patience)(error.into()))
    }

    fn random(&mut self) -> u64 {
        self.masks.1 += 1;
        self.masks.0.hash_one(self.masks.1)
    }
}

impl Timed {
    /// What is left of the time, as sockets want it.
    fn rest(&self) -> io::Result<Option<Duration>> {
        let Some((deadline, _)) = self.deadline else {
            return Ok(None);
        };
        let rest = deadline.saturating_duration_since(Instant::now());
        if rest.is_zero() {
            return Err(io::ErrorKind::TimedOut.into());
        }
        Ok(Some(rest))
    }
}

impl Read for Timed {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        self.stream.set_read_timeout(self.rest()?)?;
        self.stream.read(buffer)
    }
}

impl Write for Timed {
    fn write(&mut self, buffer: &[u8]) -> io::Result<usize> {
        self.stream.set_write_timeout(self.rest()?)?;
        self.stream.write(buffer)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.stream.flush()
    }
}

/// Calls the operating system's word for it lateness.
fn name_lateness(patience: Duration) -> impl Fn(WebsocketError) -> WebsocketError {
    move |error| match error {
        WebsocketError::InputOutput(cause)
            if matches!(
                cause.kind(),
                io::ErrorKind::TimedOut | io::ErrorKind::WouldBlock
            ) =>
        {
            WebsocketError::Late(patience)
        }
        WebsocketError::InputOutput(cause)
            if matches!(
                cause.kind(),
                io::ErrorKind::ConnectionReset
                    | io::ErrorKind::ConnectionAborted
                    | io::ErrorKind::BrokenPipe
                    | io::ErrorKind::UnexpectedEof
            ) =>
        {
            WebsocketError::Closed
        }
        other => other,
    }
}
